#[path = "/work/wt/sign/crates/sdfrs-mesh/tests/signs/meshes.rs"]
pub mod meshes;
use meshes::*;
use sdfrs_mesh::Mesh;
use sdfrs_mesh::check::check;
use sdfrs_mesh::sign::*;
use std::time::Instant;
fn cpu() -> f64 {
    let s = std::fs::read_to_string("/proc/thread-self/schedstat").unwrap();
    s.split(' ').next().unwrap().parse::<f64>().unwrap() * 1e-9
}
pub fn off(path: &str) -> Mesh {
    let text = std::fs::read_to_string(path).unwrap();
    let mut it = text.lines().map(|l| l.split('#').next().unwrap()).flat_map(|l| l.split_whitespace());
    it.next();
    let nv: usize = it.next().unwrap().parse().unwrap();
    let nf: usize = it.next().unwrap().parse().unwrap();
    it.next();
    let mut m = Mesh::default();
    for _ in 0..nv {
        m.vertices.push(std::array::from_fn(|_| it.next().unwrap().parse().unwrap()));
    }
    for _ in 0..nf {
        let n: usize = it.next().unwrap().parse().unwrap();
        let v: Vec<u32> = (0..n).map(|_| it.next().unwrap().parse().unwrap()).collect();
        for k in 1..n - 1 {
            m.faces.push([v[0], v[k], v[k + 1]]);
        }
    }
    m
}
fn main() {
    let dir = "/work/meshdata/data/meshes/";
    for name in std::env::args().skip(1) {
        let mesh = if name == "ico" { icosphere(6) } else { off(&format!("{dir}{name}.off")) };
        let mesh = holed(mesh, 0.02, 3);
        let t = cpu();
        let (c, f) = check(&mesh).unwrap();
        println!(
            "{name}: {} faces, check {:.2} ms  boundary {} nonm {} mis {} needles {} comps {}",
            f.faces,
            (cpu() - t) * 1e3,
            f.boundary_edges,
            f.nonmanifold_edges,
            f.misoriented_edges,
            f.needle_faces,
            f.components
        );
        let signs = Signs::new(&c, &f, SignRule::Winding).unwrap();
        let t = Instant::now();
        let mut o = [false];
        signs.inside_many(&[[0.9; 3]], &mut o);
        println!("  build {:.2} ms", t.elapsed().as_secs_f64() * 1e3);
        let mut dice = Dice::new(5);
        let n = 20000;
        let volume: Vec<[f64; 3]> = (0..n).map(|_| dice.point(1.0)).collect();
        let near: Vec<[f64; 3]> = (0..n)
            .map(|_| {
                let f = dice.below(c.faces.len());
                let [a, b, d] = c.corners(f);
                let o = dice.point(0.01);
                std::array::from_fn(|i| (a[i] + b[i] + d[i]) / 3.0 + o[i])
            })
            .collect();
        for (what, pts) in [("volume", &volume), ("near", &near)] {
            let mut out = vec![false; n];
            let mut conf = vec![0.0; n];
            let (mut t0, mut t1) = (f64::MAX, f64::MAX);
            for _ in 0..3 {
                let t = cpu();
                signs.inside_many(pts, &mut out);
                t0 = t0.min(cpu() - t);
                let t = cpu();
                signs.confidence_many(pts, &mut conf);
                t1 = t1.min(cpu() - t);
            }
            let k = 2000;
            let t = cpu();
            let exact: Vec<f64> = pts[..k].iter().map(|p| signs.winding(*p)).collect();
            let te = (cpu() - t) / k as f64;
            let wrong = exact.iter().zip(&out).filter(|(w, o)| (**w > 0.5) != **o).count();
            let err = exact
                .iter()
                .zip(&conf)
                .map(|(w, c)| ((2.0 * w - 1.0).abs().min(1.0) - c).abs() / 2.0)
                .fold(0.0, f64::max);
            let close = exact.iter().filter(|w| (**w - 0.5).abs() < 0.05).count();
            println!(
                "  {what}: inside {:.2} us, guess only {:.2} us, exact {:.1} us; wrong {wrong}/{k}, err {err:.1e}, near half {close}",
                t0 / n as f64 * 1e6,
                t1 / n as f64 * 1e6,
                te * 1e6
            );
        }
    }
}
