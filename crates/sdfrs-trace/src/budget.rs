//! Memory asked for is compared with memory there is before anything is allocated.
//!
//! Law: a refused size has allocated nothing (NUMERICS 4, R15).

use std::sync::OnceLock;

use sdfrs_core::SceneError;

/// Largest number of pixels along one side.
pub const MAX_SIDE: u64 = 65_536;
/// Largest number of pixels of one picture.
pub const MAX_PIXELS: u64 = 1 << 31;
/// What a picture keeps per pixel (depth, colour, normal, counts), rounded up.
pub const BYTES_PER_PIXEL: u64 = 64;
/// Where the system doesn't say how much memory it has.
const DEFAULT_MEMORY: u64 = 8 << 30;

/// Physical memory in bytes: read from the system on Linux, 8 GiB elsewhere.
pub fn physical_memory() -> u64 {
    static MEMORY: OnceLock<u64> = OnceLock::new();
    *MEMORY.get_or_init(|| {
        std::fs::read_to_string("/proc/meminfo").ok().and_then(|text| total(&text)).unwrap_or(DEFAULT_MEMORY)
    })
}

/// The figure of the `MemTotal: 123 kB` line.
fn total(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find_map(|l| l.strip_prefix("MemTotal:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kib.checked_mul(1024).filter(|&bytes| bytes > 0)
}

/// Refuses to need more than half of the physical memory.
pub fn check_bytes(what: &str, asked: u64) -> Result<(), SceneError> {
    let allowed = physical_memory() / 2;
    if asked > allowed {
        let message =
            format!("needs {} MiB, allowed: {} MiB (half of the memory)", asked >> 20, allowed >> 20);
        return Err(SceneError::new(what, message));
    }
    Ok(())
}

/// Refuses empty pictures and those too large to be meant; the same on every machine.
pub fn check_pixels(width: u64, height: u64) -> Result<(), SceneError> {
    let side = 1..=MAX_SIDE;
    let pixels = width.saturating_mul(height);
    if !side.contains(&width) || !side.contains(&height) || pixels > MAX_PIXELS {
        let message = format!(
            "got {width} x {height} pixels, allowed: 1 to {MAX_SIDE} along each side, {MAX_PIXELS} in all"
        );
        return Err(SceneError::new("camera image", message));
    }
    Ok(())
}

/// Refuses pictures that this machine can't hold.
pub fn check_image(width: u64, height: u64) -> Result<(), SceneError> {
    check_pixels(width, height)?;
    check_bytes("camera image", width * height * BYTES_PER_PIXEL)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_the_systems_own_words() {
        assert_eq!(total("MemTotal:       16384 kB\nMemFree: 1 kB\n"), Some(16384 * 1024));
        assert_eq!(total("MemFree: 1 kB\n"), None);
        assert_eq!(total("MemTotal: many kB\n"), None);
        assert!(physical_memory() >= 1 << 20);
    }

    #[test]
    fn sizes_are_compared_before_they_overflow() {
        for (w, h) in [(0, 1), (1, 0), (65_537, 1), (u64::MAX, u64::MAX), (65_536, 65_536)] {
            assert!(check_pixels(w, h).is_err(), "{w} x {h}");
        }
        assert!(check_pixels(1, 1).is_ok() && check_image(1, 1).is_ok() && check_pixels(1280, 720).is_ok());
        assert!(check_bytes("test", physical_memory()).is_err() && check_bytes("test", 1).is_ok());
    }
}
