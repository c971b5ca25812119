//! Least times of many runs, in CPU time: what other processes do lengthens the wall clock, not the least time.
//!
//! Of two hundred runs the shortest is left out: a virtual machine takes away time that its host stole, at
//! moments of its own, so that some runs appear shorter than they can be.

/// CPU seconds of this process.
#[allow(unsafe_code)]
pub fn cpu() -> f64 {
    #[cfg(unix)]
    {
        let mut t = libc::timespec { tv_sec: 0, tv_nsec: 0 };
        // SAFETY: a valid pointer to write to.
        unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut t) };
        t.tv_sec as f64 + t.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    {
        std::time::UNIX_EPOCH.elapsed().map_or(0.0, |t| t.as_secs_f64())
    }
}

/// Memory that was asked for once stays with the process, as in one that makes picture after picture: otherwise the
/// allocator's mood decides who pays for new pages.
#[allow(unsafe_code)]
pub fn keep_memory() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: two settings of the allocator, before any other thread runs.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 30);
        libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
    }
}

/// Least seconds (but for one of two hundred) that a run of each job takes; the jobs alternate, so that all see the same machine.
pub fn minima<const N: usize>(seconds: f64, mut jobs: [&mut dyn FnMut(); N]) -> [f64; N] {
    let mut times: [Vec<f64>; N] = std::array::from_fn(|_| Vec::new());
    let mut repeats = [1usize; N];
    // A run should last long enough for the clock's grain.
    for (job, repeats) in jobs.iter_mut().zip(&mut repeats) {
        job();
        let start = cpu();
        job();
        let one = (cpu() - start).max(1e-8);
        *repeats = (3e-4 / one).clamp(1.0, 1e5) as usize;
    }
    let start = cpu();
    while cpu() - start < seconds * N as f64 || times.iter().any(|t| t.is_empty()) {
        for i in 0..N {
            let start = cpu();
            for _ in 0..repeats[i] {
                jobs[i]();
            }
            let one = (cpu() - start) / repeats[i] as f64;
            if one > 0.0 {
                times[i].push(one);
            }
        }
    }
    times.map(|mut t| {
        t.sort_by(f64::total_cmp);
        t[t.len() / 200]
    })
}
