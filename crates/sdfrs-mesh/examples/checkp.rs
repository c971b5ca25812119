#[path = "scratch.rs"]
#[allow(dead_code)]
mod scratch;
use sdfrs_mesh::check::check;
fn main() {
    for name in std::env::args().skip(1) {
        let mesh = scratch::off(&format!("/work/meshdata/data/meshes/{name}.off"));
        let mut best = f64::MAX;
        for _ in 0..200 {
            let t = std::time::Instant::now();
            std::hint::black_box(check(&mesh).unwrap());
            best = best.min(t.elapsed().as_secs_f64());
        }
        println!("{name}: {} faces {:.2} ms", mesh.faces.len(), best * 1e3);
    }
}
