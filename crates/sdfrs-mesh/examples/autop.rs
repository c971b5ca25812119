#[path = "scratch.rs"]
#[allow(dead_code)]
mod scratch;
use sdfrs_mesh::{check::check, sign::*};
fn main() {
    let mesh = scratch::off("/work/meshdata/data/meshes/bunny00.off");
    let (c, f) = check(&mesh).unwrap();
    for _ in 0..60 {
        std::hint::black_box(Signs::new(&c, &f, SignRule::Auto).unwrap());
    }
}
