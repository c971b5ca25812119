use sdfrs_mesh::read::*;
fn main() {
    for kind in 0..4 {
        let n = 4096;
        let mut t = String::new();
        for i in 0..n {
            let a = i as f64 / n as f64 * std::f64::consts::TAU;
            let r = match kind {
                0 => {
                    if i % 2 == 0 {
                        1.0
                    } else {
                        0.9
                    }
                }
                1 => 1.0 + a,
                2 => {
                    if i % 2 == 0 {
                        1.0
                    } else {
                        0.01
                    }
                }
                _ => 1.0,
            };
            let k = if kind == 1 { a * 20.0 } else { a };
            if kind == 3 {
                t += &format!(
                    "v {} {} 0\n",
                    if i % 2 == 0 { 0.0 } else { 1.0 + (i as f64) },
                    (i * 7919 % n) as f64
                );
            } else {
                t += &format!("v {} {} 0\n", r * k.cos(), r * k.sin());
            }
        }
        t += "f";
        for i in 1..=n {
            t += &format!(" {i}");
        }
        let s = std::time::Instant::now();
        let m = parse(Format::Obj, t.as_bytes());
        println!("{kind}: {:?} {:?}", m.map(|m| m.faces.len()), s.elapsed());
    }
    let mut t = String::new();
    for i in 0..300 {
        for j in 0..300 {
            t += &format!("v {}.123456 {}.98765 {}.5\n", i, j, i * j);
        }
    }
    for i in 0..299 {
        for j in 0..299 {
            let a = i * 300 + j + 1;
            t += &format!("f {}/1/1 {}/1/1 {}/1/1 {}/1/1\n", a, a + 1, a + 301, a + 300);
        }
    }
    let s = std::time::Instant::now();
    println!(
        "{:?} {} bytes {:?}",
        parse(Format::Obj, t.as_bytes()).unwrap().faces.len(),
        t.len(),
        s.elapsed()
    );
}
