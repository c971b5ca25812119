#[path = "scratch.rs"]
#[allow(dead_code)]
mod scratch;
use sdfrs_mesh::{check::check, sign::*};
fn main() {
    for name in std::env::args().skip(1) {
        let mesh = scratch::off(&format!("/work/meshdata/data/meshes/{name}.off"));
        let (c, f) = check(&mesh).unwrap();
        let best = |g: &dyn Fn()| {
            (0..40)
                .map(|_| {
                    let t = std::time::Instant::now();
                    g();
                    t.elapsed().as_secs_f64() * 1e3
                })
                .fold(f64::MAX, f64::min)
        };
        let auto = best(&|| drop(Signs::new(&c, &f, SignRule::Auto).unwrap()));
        let pseudo = best(&|| drop(Signs::new(&c, &f, SignRule::Pseudonormal).unwrap()));
        let tree = best(&|| drop(Signs::new(&c, &f, SignRule::Winding).unwrap().nearest([0.9; 3])));
        let axis: Vec<f64> = (0..128).map(|i| i as f64 / 63.5 - 1.0).collect();
        let s = Signs::new(&c, &f, SignRule::Pseudonormal).unwrap();
        let cols = best(&|| drop(s.columns([&axis, &axis, &axis], 1 << 28).unwrap()));
        println!("{name}: auto {auto:.1} pseudo {pseudo:.1} tree {tree:.1} columns128 {cols:.1} ms");
    }
}
