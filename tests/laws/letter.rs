//! The harness can fail: the forms as printed lose surfaces where NUMERICS says they do, and in that order.

use std::error::Error;

use sdfrs_core::contract::{Limits, Prune};
use sdfrs_laws::families::EPS;
use sdfrs_laws::tracers::reach;
use sdfrs_laws::{Family, Pack, Verdict, judge, letter, name, problems};
use sdfrs_trace::tracer::{Form, SearchForm, Tracer};

const RAYS: usize = 5000;
const LIMITS: Limits = Limits { eps: EPS, cone: 0.0, max_steps: 4096, prune: Prune::Off };

fn run(tracer: &Tracer, family: Family) -> Result<Verdict, Box<dyn Error>> {
    let all = problems(family, RAYS, 7);
    let pack = Pack::new(&all);
    let hits = pack.trace::<f64>(tracer, &LIMITS)?;
    let verdict = judge(&all, &pack, &hits, &LIMITS, reach(tracer));
    println!("{family:?} {}: {}", name(tracer), verdict.row());
    Ok(verdict)
}

fn percent(count: usize) -> f64 {
    100.0 * count as f64 / RAYS as f64
}

const RELAXED: Tracer = Tracer::Relaxed { omega: 1.5, form: Form::Y2023, guards: false };
const ENHANCED: Tracer = Tracer::Enhanced { omega: 0.88, form: Form::Y2023, guards: false };
const AUTO: Tracer = Tracer::AutoRelaxed { beta: 0.3, guards: false };

#[test]
fn touching_balls_hide_sheets() -> Result<(), Box<dyn Error>> {
    let [relaxed, enhanced, auto] = [RELAXED, ENHANCED, AUTO].map(|t| run(&t, Family::Sheets));
    let (relaxed, enhanced, auto) = (relaxed?, enhanced?, auto?);
    assert!(percent(relaxed.missed) > 10.0);
    assert!(percent(enhanced.missed) > 1.0 && percent(auto.missed) > 3.0);
    assert!(relaxed.missed > enhanced.missed && relaxed.missed > auto.missed);
    Ok(())
}

#[test]
fn the_unsigned_test_lands_inside() -> Result<(), Box<dyn Error>> {
    for tracer in [RELAXED, ENHANCED, AUTO] {
        let lattice = run(&tracer, Family::Lattice)?;
        assert!(percent(lattice.late + lattice.missed) > 5.0);
        let receding = run(&tracer, Family::Receding)?;
        assert!(percent(receding.late) > 25.0);
        assert!(receding.deep > 0);
    }
    let relaxed = run(&RELAXED, Family::Lattice)?;
    let auto = run(&AUTO, Family::Lattice)?;
    assert!(relaxed.late > auto.late);
    Ok(())
}

#[test]
fn the_plain_walk_is_sound_as_printed() -> Result<(), Box<dyn Error>> {
    for family in
        [Family::RandomSlopes, Family::Lattice, Family::SpheresAndPlane, Family::Sheets, Family::Receding]
    {
        assert!(run(&Tracer::Basic { guards: false }, family)?.clean());
    }
    Ok(())
}

#[test]
fn the_printed_split_does_not_end() -> Result<(), Box<dyn Error>> {
    let split = Tracer::BinarySearch { form: SearchForm::Split, max_level: 18, guards: false };
    assert!(percent(run(&split, Family::Receding)?.unresolved) > 50.0);
    assert!(percent(run(&split, Family::Lattice)?.unresolved) > 20.0);
    Ok(())
}

#[test]
fn ordinary_rays_are_fine_in_every_printed_stepper() -> Result<(), Box<dyn Error>> {
    for tracer in letter().iter().filter(|t| !matches!(t, Tracer::BinarySearch { .. })) {
        let verdict = run(tracer, Family::RandomSlopes)?;
        assert!(percent(verdict.missed + verdict.late) < 0.5, "{}", name(tracer));
    }
    Ok(())
}
