//! Fields steeper than they say: the crossing is counted, the witness names the slope, and no stepper
//! reports a point inside. (A surface jumped over whole is lost to any tracer.)

use std::error::Error;

use sdfrs_core::contract::{FLAG_CROSSING, Limits, Prune};
use sdfrs_core::eval::Native;
use sdfrs_laws::families::EPS;
use sdfrs_laws::field::samples;
use sdfrs_laws::tracers::{is_search, reach};
use sdfrs_laws::{Family, Pack, guarded, judge, name, problems};

const LIMITS: Limits = Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off };

fn steep<T: Native>(steepness: f64) -> Result<(), Box<dyn Error>> {
    for family in [Family::RandomSlopes, Family::SpheresAndPlane] {
        let all = problems(family, 5000, 11);
        for tracer in guarded() {
            let mut pack = Pack::new(&all);
            pack.steepness = steepness;
            let hits = pack.trace::<T>(&tracer, &LIMITS)?;
            let verdict = judge(&all, &pack, &hits, &LIMITS, reach(&tracer));
            let crossings = hits.flags.iter().filter(|f| **f & FLAG_CROSSING != 0).count();
            println!("L {steepness} {family:?} {}: {} crossings {crossings}", name(&tracer), verdict.row());
            if verdict.deep + verdict.far > 0
                && let Some(i) = verdict.first
            {
                println!("  ray {i} {:?}", all[i]);
                println!("  t {:?} steps {} flags {}", hits.t[i], hits.steps[i], hits.flags[i]);
                println!("  samples {:?}", samples::<T>(&all[i], steepness, &tracer, &LIMITS));
            }
            if is_search(&tracer) {
                continue;
            }
            assert_eq!(verdict.deep, 0);
            assert_eq!(verdict.invalid, 0);
            assert!(crossings > 0);
            // Five evaluations bring all but the most bent brackets within the threshold.
            let what = format!("{} of {crossings} crossings left far out: {}", verdict.far, name(&tracer));
            assert!(verdict.far * 5 <= crossings, "L {steepness} {family:?} {what}");
            assert!(verdict.witness > 1.01);
        }
    }
    Ok(())
}

#[test]
fn crossings_are_counted_f32() -> Result<(), Box<dyn Error>> {
    [1.02, 1.1, 1.5, 2.0].into_iter().try_for_each(steep::<f32>)
}

#[test]
fn crossings_are_counted_f64() -> Result<(), Box<dyn Error>> {
    [1.02, 1.1, 1.5, 2.0].into_iter().try_for_each(steep::<f64>)
}
