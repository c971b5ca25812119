//! The worker threads: one pool of our own per process, so that a fork never meets a dead pool.
//!
//! Law: results are the same bits for any number of threads (tests/laws).

use std::sync::{Arc, Mutex, PoisonError};

use rayon::{ThreadPool, ThreadPoolBuilder};

struct Entry {
    pid: u32,
    threads: usize,
    pool: Arc<ThreadPool>,
}

static POOL: Mutex<Option<Entry>> = Mutex::new(None);
static WANTED: Mutex<usize> = Mutex::new(0);

/// Number of worker threads from now on; 0 means as many as there are cores (or SDFRS_THREADS).
pub fn set_threads(n: usize) {
    *WANTED.lock().unwrap_or_else(PoisonError::into_inner) = n;
}

/// Number of worker threads in use.
pub fn threads() -> usize {
    let wanted = *WANTED.lock().unwrap_or_else(PoisonError::into_inner);
    let from_env =
        || std::env::var("SDFRS_THREADS").ok().and_then(|v| v.parse().ok()).filter(|&n: &usize| n > 0);
    let n = if wanted > 0 { Some(wanted) } else { from_env() };
    n.unwrap_or_else(|| std::thread::available_parallelism().map_or(1, usize::from)).min(1024)
}

/// Runs `work` inside the pool; on the calling thread where no pool can be made.
pub fn install<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    match current() {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

fn current() -> Option<Arc<ThreadPool>> {
    let (pid, threads) = (std::process::id(), threads());
    let mut slot = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(entry) = slot.as_ref() {
        if entry.pid == pid && entry.threads == threads {
            return Some(entry.pool.clone());
        }
        if entry.pid != pid {
            // After a fork the pool's threads don't exist here: joining them would hang, so it is forgotten.
            std::mem::forget(slot.take());
        }
    }
    let pool = Arc::new(
        ThreadPoolBuilder::new().num_threads(threads).thread_name(|i| format!("sdfrs-{i}")).build().ok()?,
    );
    *slot = Some(Entry { pid, threads, pool: pool.clone() });
    Some(pool)
}
