use sdfrs_mesh::{check::check, read::*, sign::*};
use std::time::Instant;
fn main() {
    for path in std::env::args().skip(1) {
        let t = Instant::now();
        let mesh = match read(&path) {
            Ok(m) => m,
            Err(e) => {
                println!("{e}");
                continue;
            }
        };
        let t_read = t.elapsed().as_secs_f64() * 1e3;
        let t = Instant::now();
        match check(&mesh) {
            Ok((c, f)) => {
                let tc = t.elapsed().as_secs_f64() * 1e3;
                let t = Instant::now();
                let s = Signs::new(&c, &f, SignRule::Auto).unwrap();
                let ts = t.elapsed().as_secs_f64() * 1e3;
                let mut x = 88172645463325252u64;
                let mut r = || {
                    x ^= x << 13;
                    x ^= x >> 7;
                    x ^= x << 17;
                    (x >> 11) as f64 / (1u64 << 53) as f64
                };
                let n = (20_000_000 / c.faces.len()).clamp(20, 4000);
                let pts: Vec<[f64; 3]> = (0..n)
                    .map(|i| {
                        if i % 2 == 0 {
                            std::array::from_fn(|_| 2.0 * r() - 1.0)
                        } else {
                            let v = c.vertices[(r() * c.vertices.len() as f64) as usize];
                            std::array::from_fn(|k| v[k] + 0.02 * (r() - 0.5))
                        }
                    })
                    .collect();
                let mut out = vec![false; n];
                s.inside_many(&pts, &mut out);
                let mut par = vec![false; n];
                Signs::new(&c, &f, SignRule::Parity).unwrap().inside_many(&pts, &mut par);
                let wrong = pts.iter().zip(&out).filter(|(p, o)| (s.winding(**p) > 0.5) != **o).count();
                let parity = par.iter().zip(&out).filter(|(p, o)| *p != *o).count();
                println!(
                    "{}: {} faces read {t_read:.1} check {tc:.1} signs {ts:.1} ms; {:?} ({}); wrong {wrong}/{n} parity differs {parity}; V {:.3e} welded {} deg {} dup {} comps {}",
                    path.rsplit('/').next().unwrap(),
                    f.faces,
                    s.method(),
                    s.why(),
                    f.signed_volume,
                    f.welded_vertices,
                    f.degenerate_faces,
                    f.duplicate_faces,
                    f.components
                );
            }
            Err(e) => println!("{path}: {e}"),
        }
    }
}
