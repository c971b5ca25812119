//! Times one bake: `mesh FILE.off|icosphere:LEVEL RESOLUTION [sparse] [repeats=N] [threads=N] [against=N] [raw=FILE]`.
//!
//! Prints one line of JSON: the least CPU and wall time of the repeats, everything from the mesh in memory to the grid
//! in memory included. `against` takes turns with another number of threads and prints how many times longer that takes
//! (wall). SDFRS_ISA caps the instruction set. `raw` writes the values of a dense grid as f32, x fastest.

use std::{collections::HashMap, io::Write, time::Instant};

use sdfrs_benches::clock::cpu;
use sdfrs_mesh::{
    Mesh,
    bake::{Baked, Resolution, Settings, Values, bake},
};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let [source, resolution, options @ ..] = args.as_slice() else {
        return Err(
            "usage: mesh FILE.off|icosphere:LEVEL RESOLUTION [sparse] [repeats=N] [threads=N] [against=N] [raw=FILE]"
                .into(),
        );
    };
    let option = |name: &str| options.iter().find_map(|o| o.strip_prefix(name)?.strip_prefix('='));
    let repeats: usize = option("repeats").unwrap_or("3").parse()?;
    let pool = |threads: &str| -> Result<_, Failure> {
        Ok(rayon::ThreadPoolBuilder::new().num_threads(threads.parse()?).build()?)
    };
    let (own, other) = (pool(option("threads").unwrap_or("1"))?, option("against").map(pool).transpose()?);
    let mesh = match source.strip_prefix("icosphere:") {
        Some(level) => icosphere(level.parse()?),
        None => off(&std::fs::read_to_string(source)?)?,
    };
    let sparse = options.iter().any(|o| o == "sparse");
    let settings =
        Settings { resolution: Resolution::Cube(resolution.parse()?), sparse, ..Settings::default() };
    let (mut least_cpu, mut least_wall, mut other_wall) = (f64::INFINITY, f64::INFINITY, f64::INFINITY);
    let mut last = None;
    for _ in 0..repeats.max(1) {
        drop(last.take());
        let (cpu_start, wall_start) = (cpu(), Instant::now());
        last = Some(own.install(|| bake(&mesh, &settings, &()))?);
        least_wall = least_wall.min(wall_start.elapsed().as_secs_f64());
        least_cpu = least_cpu.min(cpu() - cpu_start);
        if let Some(other) = &other {
            drop(last.take());
            let wall_start = Instant::now();
            last = Some(other.install(|| bake(&mesh, &settings, &()))?);
            other_wall = other_wall.min(wall_start.elapsed().as_secs_f64());
        }
    }
    let Some(baked) = last else { return Ok(()) };
    if let (Some(path), Values::Dense(values)) = (option("raw"), &baked.values) {
        let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
        for v in values {
            file.write_all(&v.to_le_bytes())?;
        }
    }
    report(&mesh, &baked, least_cpu, least_wall);
    if other_wall.is_finite() {
        println!("{{\"against\": {other_wall:.6}, \"ratio\": {:.3}}}", other_wall / least_wall);
    }
    Ok(())
}

fn report(mesh: &Mesh, baked: &Baked, cpu: f64, wall: f64) {
    let nodes: u64 = baked.dims.iter().product();
    let bytes = match &baked.values {
        Values::Dense(v) => 4 * v.len(),
        Values::Sparse(s) => 4 * (s.words.len() + s.nodes.len()),
    };
    println!(
        "{{\"faces\": {}, \"nodes\": {nodes}, \"cpu\": {cpu:.6}, \"wall\": {wall:.6}, \"bytes\": {bytes}, \"peak_rss\": {}, \
         \"lo\": {:?}, \"hi\": {:?}, \"max_error\": {:e}, \"method\": \"{:?}\"}}",
        mesh.faces.len(),
        peak(),
        baked.lo,
        baked.hi,
        baked.max_error,
        baked.method,
    );
}

/// The most memory this process has held, bytes; 0 where the system doesn't say.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kb| kb * 1024)
}

/// Vertices, then polygons, which are cut into fans.
fn off(text: &str) -> Result<Mesh, Failure> {
    let mut words = text.lines().map(|l| l.split('#').next().unwrap_or("")).flat_map(str::split_whitespace);
    if words.next() != Some("OFF") {
        return Err("not an OFF file".into());
    }
    let mut word = || words.next().ok_or("the file ends early");
    let (vertices, faces): (usize, usize) = (word()?.parse()?, word()?.parse()?);
    word()?;
    let mut mesh = Mesh::default();
    for _ in 0..vertices {
        mesh.vertices.push([word()?.parse()?, word()?.parse()?, word()?.parse()?]);
    }
    for _ in 0..faces {
        let corners: usize = word()?.parse()?;
        let polygon = (0..corners).map(|_| Ok(word()?.parse()?)).collect::<Result<Vec<u32>, Failure>>()?;
        mesh.faces.extend((2..corners).map(|k| [polygon[0], polygon[k - 1], polygon[k]]));
    }
    Ok(mesh)
}

/// 20 * 4^level faces of a unit sphere.
fn icosphere(level: usize) -> Mesh {
    let t = (1.0 + 5f64.sqrt()) / 2.0;
    let unit = |p: [f64; 3]| {
        let l = (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt();
        p.map(|x| x / l)
    };
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    for (u, v) in [(-1.0, t), (1.0, t), (-1.0, -t), (1.0, -t)] {
        vertices.extend([[u, v, 0.0], [0.0, u, v], [v, 0.0, u]].map(unit));
    }
    // The faces are the triples of neighbours.
    let near = |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum::<f64>() < 1.2;
    let mut faces: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [p, q, r] = [a, b, c].map(|i| vertices[i]);
                if near(p, q) && near(q, r) && near(r, p) {
                    let det = p[0] * (q[1] * r[2] - q[2] * r[1]) - p[1] * (q[0] * r[2] - q[2] * r[0])
                        + p[2] * (q[0] * r[1] - q[1] * r[0]);
                    faces.push(if det > 0.0 { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                }
            }
        }
    }
    for _ in 0..level {
        let mut middles = HashMap::new();
        let mut next = Vec::with_capacity(4 * faces.len());
        for [a, b, c] in faces {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let (p, q) = (vertices[i as usize], vertices[j as usize]);
                    vertices.push(unit([p[0] + q[0], p[1] + q[1], p[2] + q[2]]));
                    vertices.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            next.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        faces = next;
    }
    Mesh { vertices, faces }
}
