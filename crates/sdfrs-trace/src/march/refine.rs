//! Surfaces that a safe step went through are looked for between its ends, all rays of a tile together.
//!
//! A field steeper than declared is reported, not trusted: the hit lies in front of the crossing.

use sdfrs_core::{Field, Scratch, Status, eval::Native};

use super::{
    Threshold,
    ends::{Crossing, End, Sink},
};

/// Refines every crossing; each evaluation is a step of its ray. Gives their number.
pub fn refine<T: Native>(
    field: &dyn Field<T>,
    scratch: &mut Scratch<T>,
    limit: &Threshold<T>,
    mut crossings: Vec<Crossing<T>>,
    sink: &mut impl Sink<T>,
) -> u64 {
    let mut points = 0;
    let mut more = |c: &mut Crossing<T>, narrowed: bool| {
        let guess = c.bracket.guess().filter(|_| narrowed && !c.tally.spent());
        if guess.is_none() {
            (c.tally.t, c.tally.r) = c.bracket.outer();
            let t = c.tally.t;
            sink.end(c.place, &End::of(Status::Hit, &c.tally), || c.at(t));
            sink.hit(c.e);
        }
        guess
    };
    let mut asks: Vec<T> = Vec::new();
    crossings.retain_mut(|c| more(c, true).inspect(|t| asks.push(*t)).is_some());
    let mut p: [Vec<T>; 3] = Default::default();
    let mut r = Vec::new();
    while !crossings.is_empty() {
        for a in 0..3 {
            p[a].clear();
            p[a].extend(crossings.iter().zip(&asks).map(|(c, t)| c.at(*t)[a]));
        }
        r.resize(crossings.len(), T::of(0.0));
        field.eval(scratch, [&p[0], &p[1], &p[2]], &mut r);
        points += r.len() as u64;
        let mut next = Vec::new();
        let mut i = 0;
        crossings.retain_mut(|c| {
            c.e = limit.sample(asks[i], p.each_ref().map(|p| p[i]), r[i]).e;
            c.tally.steps += 1;
            let narrowed = c.bracket.narrow(asks[i], r[i], c.e);
            i += 1;
            more(c, narrowed).inspect(|t| next.push(*t)).is_some()
        });
        asks = next;
    }
    points
}
