//! Large pages for large memory. A picture's arrays take tens of megabytes, and the first touch of each page of 4 KiB is
//! a visit to the kernel: half of a picture's time where they come fresh every time.
//!
//! Only a wish, and only where the system takes such: what memory holds does not depend on it.

/// From so many bytes on: a large page of most processors.
const LARGE: usize = 1 << 21;

/// Bytes that allocators keep beside what was asked for, generously: with them a large piece of memory fills large pages,
/// and the kernel places it at the beginning of one.
const BESIDE: usize = 1 << 12;

/// Zeros that nobody has touched yet.
pub fn zeros<V: Copy + Default>(n: usize) -> Vec<V> {
    let mut memory = vec![V::default(); whole(n, size_of::<V>())];
    wish(&memory);
    memory.truncate(n);
    memory
}

/// Room for so many values.
pub fn room<V>(n: usize) -> Vec<V> {
    let memory = Vec::with_capacity(whole(n, size_of::<V>()));
    wish(&memory);
    memory
}

/// So many values at least, and where they are large as many as fill large pages.
fn whole(n: usize, size: usize) -> usize {
    match n.checked_mul(size) {
        Some(bytes) if bytes >= LARGE => ((bytes + BESIDE).next_multiple_of(LARGE) - BESIDE) / size,
        _ => n,
    }
}

#[cfg(target_os = "linux")]
#[allow(unsafe_code)]
fn wish<V>(memory: &Vec<V>) {
    let (from, bytes) = (memory.as_ptr() as usize, memory.capacity() * size_of::<V>());
    // SAFETY: asks for the number of bytes in a page; nothing else.
    let page = usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).unwrap_or(LARGE).max(1);
    // Also those at its ends, which it may share: then the wishes of neighbours make one.
    let (first, end) = (from / page * page, (from + bytes).next_multiple_of(page));
    if bytes >= LARGE {
        // SAFETY: pages that the vector lies in; the advice changes neither what they hold nor who may touch them. A
        // system that knows no large pages refuses, which is no harm.
        unsafe { libc::madvise(first as *mut libc::c_void, end - first, libc::MADV_HUGEPAGE) };
    }
}

#[cfg(not(target_os = "linux"))]
fn wish<V>(_: &Vec<V>) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_what_was_asked_for() {
        for n in [0, 1, 1 << 19, (1 << 20) + 3] {
            let mut memory = zeros::<f32>(n);
            assert!(memory.len() == n && memory.iter().all(|v| *v == 0.0));
            memory.fill(1.0);
            let mut room = room::<f32>(n);
            assert!(room.is_empty() && room.capacity() >= n);
            room.extend(&memory);
            assert_eq!(room, memory);
        }
    }
}
