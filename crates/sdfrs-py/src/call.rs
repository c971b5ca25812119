//! Long calls: the work runs on a thread of its own while the calling thread looks for signals.
//!
//! Every 10 ms the caller asks Python whether Ctrl-C came and reports progress; either may stop the work
//! through [`Control`]. A panic becomes an `InternalError`. Law: `tests/python/test_interrupt.py`.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::mpsc::{RecvTimeoutError, sync_channel},
    time::Duration,
};

use pyo3::prelude::*;
use sdfrs_core::Control;

use crate::error::Fault;

const POLL: Duration = Duration::from_millis(10);

/// Who wants to hear how far the work is.
pub struct Progress {
    pub callback: Option<Py<PyAny>>,
    pub total: u64,
}

impl Progress {
    pub fn none() -> Self {
        Self { callback: None, total: 0 }
    }
    fn report(&self, py: Python<'_>, done: u64) -> PyResult<()> {
        match &self.callback {
            Some(callback) => callback.call1(py, (done.min(self.total), self.total)).map(|_| ()),
            None => Ok(()),
        }
    }
}

/// Short work: without the GIL, on the calling thread.
pub fn short<R: Send>(py: Python<'_>, work: impl FnOnce() -> Result<R, Fault> + Send) -> PyResult<R> {
    Ok(py.detach(|| caught(work))?)
}

/// Long work: without the GIL, interruptible.
pub fn long<R: Send>(
    py: Python<'_>,
    progress: &Progress,
    work: impl FnOnce(&Control) -> Result<R, Fault> + Send,
) -> PyResult<R> {
    let control = Control::new();
    let result = py.detach(|| supervise(progress, &control, work))?;
    progress.report(py, progress.total)?;
    Ok(result)
}

fn supervise<R: Send>(
    progress: &Progress,
    control: &Control,
    work: impl FnOnce(&Control) -> Result<R, Fault> + Send,
) -> PyResult<R> {
    std::thread::scope(|scope| {
        let (send, receive) = sync_channel(1);
        let worker = std::thread::Builder::new().name("sdfrs-call".into());
        let spawned = worker.spawn_scoped(scope, move || {
            // Nobody listens only when this thread is being unwound; then the result has no use.
            let _ = send.send(caught(|| work(control)));
        });
        if let Err(error) = spawned {
            return Err(Fault::Internal(format!("no thread could be started: {error}")).into());
        }
        let mut stopped: Option<PyErr> = None;
        loop {
            match receive.recv_timeout(POLL) {
                Ok(result) => return stopped.map_or_else(|| Ok(result?), Err),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(Fault::Internal("the worker vanished".into()).into());
                }
                Err(RecvTimeoutError::Timeout) if stopped.is_none() => {
                    stopped = poll(progress, control.done()).err();
                    if stopped.is_some() {
                        control.cancel();
                    }
                }
                Err(RecvTimeoutError::Timeout) => {}
            }
        }
    })
}

fn poll(progress: &Progress, done: u64) -> PyResult<()> {
    Python::attach(|py| {
        py.check_signals()?;
        progress.report(py, done)
    })
}

/// Runs the work; a panic is a fault of ours, not the end of the process.
fn caught<R>(work: impl FnOnce() -> Result<R, Fault>) -> Result<R, Fault> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload
            .downcast_ref::<&str>()
            .map(|s| (*s).to_owned())
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_else(|| "a panic without a message".into());
        Err(Fault::Internal(format!("this is a fault of sdfrs, please report it: {text}")))
    })
}
