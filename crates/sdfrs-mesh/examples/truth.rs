#[path = "scratch.rs"]
#[allow(dead_code)]
mod scratch;
use scratch::meshes::*;
use sdfrs_mesh::{check::check, sign::*};
fn main() {
    for name in ["ico", "bunny00", "armadillo", "elephant", "knot1"] {
        let mesh = if name == "ico" {
            icosphere(5)
        } else {
            scratch::off(&format!("/work/meshdata/data/meshes/{name}.off"))
        };
        let (c, f) = check(&mesh).unwrap();
        let s = Signs::new(&c, &f, SignRule::Winding).unwrap();
        for share in [0.01, 0.05] {
            let bad = holed(mesh.clone(), share, 7);
            let (bc, bf) = check(&bad).unwrap();
            let bs = Signs::new(&bc, &bf, SignRule::Auto).unwrap();
            let mut dice = Dice::new(11);
            let n = 1_000_000;
            let world: Vec<[f64; 3]> = (0..n)
                .map(|_| {
                    std::array::from_fn(|k| {
                        f.bounds.0[k] + (f.bounds.1[k] - f.bounds.0[k]) * (1.2 * dice.unit() - 0.1)
                    })
                })
                .collect();
            let to = |c: &sdfrs_mesh::check::Checked| -> Vec<[f64; 3]> {
                world.iter().map(|p| std::array::from_fn(|k| (p[k] - c.centre[k]) / c.scale)).collect()
            };
            let (mut a, mut b) = (vec![false; n], vec![false; n]);
            s.inside_many(&to(&c), &mut a);
            bs.inside_many(&to(&bc), &mut b);
            let u = to(&c);
            let wrong: Vec<usize> = (0..n).filter(|&i| a[i] != b[i]).collect();
            let far = wrong
                .iter()
                .map(|&i| {
                    let q = s.nearest(u[i]).point;
                    (0..3).map(|k| (q[k] - u[i][k]).powi(2)).sum::<f64>().sqrt()
                })
                .fold(0.0, f64::max);
            println!(
                "{name} {} faces, {share} missing: {} of {n} wrong, at most {far:.1e} from the surface",
                f.faces,
                wrong.len()
            );
        }
    }
}
