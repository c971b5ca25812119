//! One opened GPU: requests, error scopes, submissions and waiting.
//!
//! A device is opened once per process and adapter and shared. Law (tests/faults.rs): no fault panics or
//! hangs; each is a typed error, and the next call works, with a new device where the old one was lost.

use std::{
    fmt,
    sync::{Arc, Mutex, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use sdfrs_core::Control;

use crate::{
    adapters::{self, AdapterInfo, Kind},
    error::GpuError,
    grids::Grids,
    pipelines::Pipelines,
};

/// Which GPU to use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    /// The best real one; never one in software.
    Auto,
    /// The best real one, else one in software.
    Any,
    /// The n-th of [`adapters::adapters`].
    Index(usize),
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Choice::Auto => f.write_str("a real GPU"),
            Choice::Any => f.write_str("any adapter"),
            Choice::Index(n) => write!(f, "adapter {n}"),
        }
    }
}

#[cfg(target_os = "linux")]
const ADVICE: &str = "install the vendor's driver, or Mesa's, which also runs in software \
    (Debian, Ubuntu: apt install mesa-vulkan-drivers libvulkan1; Fedora: dnf install mesa-vulkan-drivers vulkan-loader)";
#[cfg(not(target_os = "linux"))]
const ADVICE: &str = "install or update the graphics driver of the machine's vendor";

/// Longest silence of a driver before it is given up: every dispatch here is cut to a small part of it.
const PATIENCE: Duration = Duration::from_secs(60);
/// The same of one in software, which compiles when it first runs a shader, on a machine that may be busy.
const MORE_PATIENCE: Duration = Duration::from_secs(600);
/// How often a wait looks whether it was cancelled.
const GLANCE: Duration = Duration::from_millis(10);

/// An opened GPU; shared by all who draw on it.
pub struct Device {
    raw: wgpu::Device,
    queue: wgpu::Queue,
    info: AdapterInfo,
    limits: wgpu::Limits,
    /// What the driver last complained of outside a scope, and why the device is gone once it is.
    lost: Arc<Mutex<Option<String>>>,
    /// Held around every submission and every glance at what is done: wgpu's books go wrong, and it panics,
    /// where one thread empties the queue between another one's two looks at it.
    turn: Mutex<()>,
    pipelines: Pipelines,
    grids: Grids,
}

impl fmt::Debug for Device {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Device").field("info", &self.info).finish_non_exhaustive()
    }
}

/// Opened devices by index of their adapter, kept for the life of the process.
static OPEN: Mutex<Vec<(usize, Arc<Device>)>> = Mutex::new(Vec::new());
/// What was asked for and found where no real GPU was.
static NO_GPU: OnceLock<(String, String)> = OnceLock::new();

impl Device {
    /// The chosen GPU, opened on first use.
    pub fn request(choice: Choice) -> Result<Arc<Self>, GpuError> {
        adapters::check_process()?;
        // One at a time: two threads that ask for the first time share what the first one opens.
        let mut open = OPEN.lock().unwrap_or_else(PoisonError::into_inner);
        open.retain(|(_, device)| device.lost_because().is_none());
        let known = open.iter().find(|(index, device)| match choice {
            Choice::Auto => *index == 0 && device.info.kind != Kind::Software,
            Choice::Any => *index == 0,
            Choice::Index(n) => *index == n,
        });
        if let Some((_, device)) = known {
            return Ok(device.clone());
        }
        // A machine without a real GPU is asked once: looking takes a while, and drivers may complain each time.
        if let (Choice::Auto, Some((asked, found))) = (choice, NO_GPU.get()) {
            let (asked, found) = (asked.clone(), found.clone());
            return Err(GpuError::NoAdapter { asked, found, advice: ADVICE });
        }
        let index = adapters::enumerate().and_then(|all| Ok((pick(choice, &all)?, all)));
        if let (Choice::Auto, Err(GpuError::NoAdapter { asked, found, .. })) = (choice, &index) {
            NO_GPU.get_or_init(|| (asked.clone(), found.clone()));
        }
        let (index, all) = index?;
        // Adapter 0 may be unusable where a later one was chosen in its place.
        if let Some((_, device)) = open.iter().find(|(i, _)| *i == index) {
            return Ok(device.clone());
        }
        let device = Arc::new(Self::open(&all[index])?);
        open.push((index, device.clone()));
        Ok(device)
    }

    fn open(adapter: &wgpu::Adapter) -> Result<Self, GpuError> {
        let limits = adapter.limits();
        adapters::check_limits(&limits)?;
        let wanted = wgpu::Features::TIMESTAMP_QUERY | wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("sdfrs"),
            required_features: adapter.features() & wanted,
            required_limits: limits.clone(),
            memory_hints: wgpu::MemoryHints::MemoryUsage,
            ..Default::default()
        };
        let info = adapters::describe(adapter);
        let (raw, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|e| {
            let found = format!("{} ({})", info.name, info.driver);
            GpuError::NoAdapter { asked: "a device".into(), found: format!("{found}: {e}"), advice: ADVICE }
        })?;
        let lost = Arc::new(Mutex::new(None));
        let (on_loss, on_error) = (lost.clone(), lost.clone());
        raw.set_device_lost_callback(move |reason, message| note(&on_loss, format!("{reason:?}: {message}")));
        // Without a handler an error outside a scope would end the process.
        raw.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&on_error, error.to_string())));
        Ok(Self {
            raw,
            queue,
            info,
            limits,
            lost,
            turn: Mutex::new(()),
            pipelines: Pipelines::new(),
            grids: Grids::default(),
        })
    }

    pub fn raw(&self) -> &wgpu::Device {
        &self.raw
    }
    pub fn queue(&self) -> &wgpu::Queue {
        &self.queue
    }
    pub fn info(&self) -> &AdapterInfo {
        &self.info
    }
    pub fn limits(&self) -> &wgpu::Limits {
        &self.limits
    }
    pub fn pipelines(&self) -> &Pipelines {
        &self.pipelines
    }
    pub(crate) fn grids(&self) -> &Grids {
        &self.grids
    }
    /// A driver that runs shaders on the processor.
    pub fn is_software(&self) -> bool {
        self.info.kind == Kind::Software
    }

    /// How often the loops of a shader may go around in all, where that has an end. Mesa's drivers in software leave
    /// every loop after 65,535 rounds of all of them, and go on with whatever has been computed until then.
    pub fn most_loops(&self) -> Option<u64> {
        self.is_software().then_some(65_000)
    }

    fn lost_because(&self) -> Option<String> {
        self.lost.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Refuses a device that is gone or belongs to another process.
    pub fn check(&self) -> Result<(), GpuError> {
        adapters::check_process()?;
        match self.lost_because() {
            Some(reason) => Err(GpuError::Lost { reason }),
            None => Ok(()),
        }
    }

    /// Runs calls to the API; what any of them complains of becomes an error that names `what`.
    pub fn scoped<T>(&self, what: &str, bytes: u64, calls: impl FnOnce() -> T) -> Result<T, GpuError> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        self.check()?;
        let scopes = [Validation, OutOfMemory, Internal].map(|filter| self.raw.push_error_scope(filter));
        let value = calls();
        let mut first = None;
        for scope in scopes.into_iter().rev() {
            first = pollster::block_on(scope.pop()).or(first);
        }
        if first.is_some() {
            // A lost device makes invalid objects without a word and complains of them later. The loss is
            // the reason to report; the driver's word of it comes by polling.
            let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
            let _ = self.raw.poll(wgpu::PollType::Poll);
        }
        self.check()?;
        match first {
            None => Ok(value),
            Some(wgpu::Error::OutOfMemory { .. }) => Err(GpuError::OutOfMemory { what: what.into(), bytes }),
            Some(error) => Err(GpuError::Refused { what: what.into(), message: error.to_string() }),
        }
    }

    /// Hands commands to the GPU.
    pub fn submit(&self, encoder: wgpu::CommandEncoder) -> Result<wgpu::SubmissionIndex, GpuError> {
        let commands = encoder.finish();
        self.scoped("commands", 0, || {
            let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
            self.queue.submit([commands])
        })
    }

    /// Waits for a submission; looks every 10 ms whether it was cancelled.
    ///
    /// What was submitted runs on after a cancellation: the GPU cannot be called back, so submissions are small.
    pub fn wait(&self, submission: wgpu::SubmissionIndex, control: &Control) -> Result<(), GpuError> {
        let start = Instant::now();
        let patience = if self.is_software() { MORE_PATIENCE } else { PATIENCE };
        loop {
            let poll =
                wgpu::PollType::Wait { submission_index: Some(submission.clone()), timeout: Some(GLANCE) };
            let polled = {
                let _turn = self.turn.lock().unwrap_or_else(PoisonError::into_inner);
                self.raw.poll(poll)
            };
            self.check()?;
            match polled {
                Ok(_) => return Ok(()),
                Err(wgpu::PollError::Timeout) if control.is_cancelled() => return Err(GpuError::Cancelled),
                Err(wgpu::PollError::Timeout) if start.elapsed() > patience => {
                    let seconds = patience.as_secs();
                    return Err(GpuError::Timeout { what: self.info.name.clone(), seconds });
                }
                Err(wgpu::PollError::Timeout) => {}
                Err(error) => {
                    return Err(GpuError::Refused { what: "waiting".into(), message: error.to_string() });
                }
            }
        }
    }
}

/// Keeps the first reason: what follows is its consequence.
fn note(lost: &Mutex<Option<String>>, reason: String) {
    lost.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(reason);
}

/// Index of the adapter to use.
fn pick(choice: Choice, all: &[wgpu::Adapter]) -> Result<usize, GpuError> {
    let infos: Vec<AdapterInfo> = all.iter().map(adapters::describe).collect();
    let index = choose(choice, &infos)?;
    // Asked for by number: the reason why it cannot serve is the answer.
    adapters::check_limits(&all[index].limits())?;
    Ok(index)
}

fn choose(choice: Choice, infos: &[AdapterInfo]) -> Result<usize, GpuError> {
    let usable = |info: &AdapterInfo, software: bool| {
        info.missing.is_none() && (software || info.kind != Kind::Software)
    };
    let index = match choice {
        Choice::Auto => infos.iter().position(|info| usable(info, false)),
        Choice::Any => infos.iter().position(|info| usable(info, true)),
        Choice::Index(n) => (n < infos.len()).then_some(n),
    };
    index.ok_or_else(|| {
        let found: Vec<String> = infos
            .iter()
            .enumerate()
            .map(|(i, info)| {
                let fault = info.missing.as_ref().map_or(String::new(), |m| format!(", unusable: {m}"));
                format!("{i}: {} ({}, {}{fault})", info.name, info.kind.name(), info.backend)
            })
            .collect();
        let found = if found.is_empty() { "none".to_owned() } else { found.join("; ") };
        GpuError::NoAdapter { asked: choice.to_string(), found, advice: ADVICE }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn info(kind: Kind, missing: Option<&str>) -> AdapterInfo {
        AdapterInfo {
            name: format!("a {} one", kind.name()),
            kind,
            driver: "driver".into(),
            backend: "Vulkan".into(),
            max_binding_bytes: 1 << 27,
            max_buffer_bytes: 1 << 28,
            storage_buffers: 8,
            missing: missing.map(str::to_owned),
        }
    }

    #[test]
    fn auto_never_takes_software() {
        let (real, weak, soft) =
            (info(Kind::Discrete, None), info(Kind::Integrated, Some("weak")), info(Kind::Software, None));
        let error = choose(Choice::Auto, &[weak.clone(), soft.clone()]).unwrap_err().to_string();
        assert!(error.contains("a software one") && error.contains("unusable: weak"), "{error}");
        assert_eq!(choose(Choice::Any, &[weak.clone(), soft.clone()]), Ok(1));
        assert_eq!(choose(Choice::Auto, &[weak, real, soft.clone()]), Ok(1));
        assert_eq!(choose(Choice::Index(0), &[soft]), Ok(0));
    }

    #[test]
    fn nothing_found_says_what_to_do() {
        let error = choose(Choice::Index(3), &[]).unwrap_err().to_string();
        assert!(error.contains("asked for adapter 3, found none") && error.contains("driver"), "{error}");
    }
}
