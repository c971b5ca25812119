// Numbers as the sum of two: 48 bits where a camera's rays need more than 24. Dekker 1971, Knuth 1969.
//
// Every rounding counts, in plain mode too, hence hold() throughout (ops/memory.wgsl).

struct Pair {
    high: f32,
    low: f32,
}

// The exact sum.
fn two_sum(a: f32, b: f32) -> Pair {
    let s = hold(a + b);
    let t = hold(s - a);
    return Pair(s, hold(hold(a - hold(s - t)) + hold(b - t)));
}

// The exact sum where a is the larger.
fn quick_sum(a: f32, b: f32) -> Pair {
    let s = hold(a + b);
    return Pair(s, hold(b - hold(s - a)));
}

// Halves of 12 bits, whose products are exact.
fn halves(a: f32) -> Pair {
    let c = hold(4097.0 * a);
    let high = hold(c - hold(c - a));
    return Pair(high, hold(a - high));
}

// The exact product.
fn two_product(a: f32, b: f32) -> Pair {
    let p = hold(a * b);
    let x = halves(a);
    let y = halves(b);
    let e = hold(hold(hold(x.high * y.high) - p) + hold(x.high * y.low));
    return Pair(p, hold(hold(e + hold(x.low * y.high)) + hold(x.low * y.low)));
}

fn pair_add(a: Pair, b: Pair) -> Pair {
    let s = two_sum(a.high, b.high);
    return quick_sum(s.high, hold(s.low + hold(a.low + b.low)));
}

fn pair_multiply(a: Pair, b: Pair) -> Pair {
    let p = two_product(a.high, b.high);
    return quick_sum(p.high, hold(p.low + hold(hold(a.high * b.low) + hold(a.low * b.high))));
}

// 1 / sqrt(a): the built-in one and a step of Newton's.
fn pair_inverse_root(a: Pair) -> Pair {
    let r = hold(1.0 / sqrt(a.high));
    let error = pair_add(Pair(1.0, 0.0), pair_multiply(a, two_product(-r, r)));
    return quick_sum(r, hold(hold(0.5 * r) * error.high));
}
