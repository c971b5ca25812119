//! Prints the Markdown tables of docs/performance.md. Arguments name the tables wanted; none means all
//! but those that take minutes (`growth`).

#[cfg(target_arch = "x86_64")]
use sdfrs_benches::tables::limits;
use sdfrs_benches::tables::{eval, trace};

/// A table's name, what prints it, and whether it is printed unasked.
const TABLES: &[(&str, fn(), bool)] = &[
    ("eval", eval::eval, true),
    ("precision", eval::precision, true),
    ("trace", trace::peers, true),
    ("pruned", trace::pruned, true),
    #[cfg(target_arch = "x86_64")]
    ("packets", trace::packets, true),
    ("growth", trace::growth, false),
    ("threads", trace::threads, true),
    ("parts", trace::parts, true),
    #[cfg(target_arch = "x86_64")]
    ("arithmetic", limits::arithmetic, true),
    #[cfg(target_arch = "x86_64")]
    ("balls", limits::balls, true),
];

fn main() {
    sdfrs_core::pool::set_threads(1);
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted.iter().find(|w| TABLES.iter().all(|(name, ..)| name != w)) {
        let names: Vec<&str> = TABLES.iter().map(|(name, ..)| *name).collect();
        eprintln!("got {unknown:?}, allowed: {}", names.join(", "));
        std::process::exit(2);
    }
    println!("instruction set: {}\n", sdfrs_core::eval::isa().name());
    for (name, print, unasked) in TABLES {
        if wanted.iter().any(|w| w == name) || (wanted.is_empty() && *unasked) {
            print();
        }
    }
}
