//! Prints the Markdown tables of docs/performance.md. Arguments name the tables wanted; none means
//! all of them.

#[cfg(target_arch = "x86_64")]
use sdfrs_benches::tables::limits;
use sdfrs_benches::tables::{eval, texture, trace};

/// A table's name and what prints it.
const TABLES: &[(&str, fn())] = &[
    ("eval", eval::eval),
    ("precision", eval::precision),
    ("trace", trace::peers),
    ("pruned", trace::pruned),
    #[cfg(target_arch = "x86_64")]
    ("packets", trace::packets),
    ("growth", trace::growth),
    ("sizes", trace::sizes),
    ("threads", trace::threads),
    ("crowds", eval::crowds),
    ("texture", texture::texture),
    ("parts", trace::parts),
    #[cfg(target_arch = "x86_64")]
    ("arithmetic", limits::arithmetic),
    #[cfg(target_arch = "x86_64")]
    ("balls", limits::balls),
];

fn main() {
    sdfrs_benches::clock::keep_memory();
    sdfrs_core::pool::set_threads(1);
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if let Some(unknown) = wanted.iter().find(|w| TABLES.iter().all(|(name, _)| name != w)) {
        let names: Vec<&str> = TABLES.iter().map(|(name, _)| *name).collect();
        eprintln!("got {unknown:?}, allowed: {}", names.join(", "));
        std::process::exit(2);
    }
    println!("instruction set: {}\n", sdfrs_core::eval::isa().name());
    for (name, print) in TABLES {
        if wanted.iter().any(|w| w == name) || wanted.is_empty() {
            print();
        }
    }
}
