//! Distributions of test statistics, from two special functions.

/// `ln Γ(x)` for `x > 0`: the recurrence up to 12, then Stirling's series, whose first term left out is below 2e-13.
pub fn ln_gamma(mut x: f64) -> f64 {
    let mut shift = 0.0;
    while x < 12.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let r = 1.0 / (x * x);
    let series = (1.0 / 12.0 - r * (1.0 / 360.0 - r * (1.0 / 1260.0 - r / 1680.0))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.5 * std::f64::consts::TAU.ln() + series
}

/// A continued fraction `b0 + a1 / (b1 + a2 / (b2 + …))` by Lentz's method.
fn continued_fraction(b0: f64, term: impl Fn(f64) -> (f64, f64)) -> f64 {
    let guard = |x: f64| if x.abs() < 1e-300 { 1e-300 } else { x };
    let mut value = guard(b0);
    let (mut c, mut d) = (value, 0.0);
    for i in 1..100_000 {
        let (a, b) = term(f64::from(i));
        d = 1.0 / guard(b + a * d);
        c = guard(b + a / c);
        value *= c * d;
        if (c * d - 1.0).abs() < 1e-15 {
            break;
        }
    }
    value
}

/// The regularised upper incomplete gamma function `Γ(a, x) / Γ(a)`.
pub fn gamma_q(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let scale = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-17 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        1.0 - scale * sum
    } else {
        scale / continued_fraction(x + 1.0 - a, |i| (i * (a - i), x + 2.0 * i + 1.0 - a))
    }
}

/// The regularised incomplete beta function `I_x(a, b)`.
fn beta_i(a: f64, b: f64, x: f64) -> f64 {
    if x > (a + 1.0) / (a + b + 2.0) {
        return 1.0 - beta_i(b, a, 1.0 - x);
    }
    let scale = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    let fraction = continued_fraction(1.0, |i| {
        let m = (i / 2.0).floor();
        let numerator = if i % 2.0 == 0.0 {
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m))
        } else {
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0))
        };
        (numerator, 1.0)
    });
    scale / (a * fraction)
}

/// How likely chance makes a chi-square statistic at least this large.
pub fn p_chi_square(statistic: f64, degrees: usize) -> f64 {
    gamma_q(degrees as f64 / 2.0, statistic / 2.0)
}

/// How likely chance makes a Student statistic at least this large by amount; a normal one for infinite `degrees`.
pub fn p_student(t: f64, degrees: f64) -> f64 {
    if degrees > 1e6 {
        gamma_q(0.5, t * t / 2.0)
    } else {
        beta_i(degrees / 2.0, 0.5, degrees / (degrees + t * t))
    }
}

/// The p-value below which one of `tests` independent tests is rejected, so that all of them together raise a false
/// alarm with probability `alpha` (Šidák 1967). Valid for dependent two-sided normal tests too.
pub fn sidak(alpha: f64, tests: usize) -> f64 {
    -((-alpha).ln_1p() / tests as f64).exp_m1()
}

/// Pearson's test of counts against expectations. Neighbouring cells are pooled until each expects `LEAST`.
pub fn chi_square(observed: &[f64], expected: &[f64]) -> ChiSquare {
    const LEAST: f64 = 25.0;
    let (mut pooled, mut o, mut e) = (Vec::new(), 0.0, 0.0);
    for (x, y) in observed.iter().zip(expected) {
        o += x;
        e += y;
        if e >= LEAST {
            pooled.push((o, e));
            (o, e) = (0.0, 0.0);
        }
    }
    // What is left over joins the last pool, so that nothing that was observed is lost.
    match pooled.last_mut() {
        Some(last) => *last = (last.0 + o, last.1 + e),
        None => pooled.push((o, e)),
    }
    let statistic = pooled.iter().map(|(o, e)| (o - e).powi(2) / e).sum();
    let degrees = pooled.len() - 1;
    ChiSquare {
        statistic,
        degrees,
        p: p_chi_square(statistic, degrees.max(1)),
    }
}

/// The outcome of [`chi_square`].
#[derive(Clone, Copy, Debug)]
pub struct ChiSquare {
    pub statistic: f64,
    pub degrees: usize,
    pub p: f64,
}

/// Integral over `[a, b]` by `pieces` times five Gauss-Legendre points: exact for polynomials of degree 9.
pub fn integrate(a: f64, b: f64, pieces: usize, mut f: impl FnMut(f64) -> f64) -> f64 {
    const NODES: [(f64, f64); 5] = [
        (-0.906_179_845_938_664, 0.236_926_885_056_189_08),
        (-0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.0, 0.568_888_888_888_888_9),
        (0.538_469_310_105_683, 0.478_628_670_499_366_47),
        (0.906_179_845_938_664, 0.236_926_885_056_189_08),
    ];
    let half = (b - a) / pieces as f64 / 2.0;
    let mut sum = 0.0;
    for i in 0..pieces {
        let middle = a + half * (2 * i + 1) as f64;
        sum += NODES.iter().map(|(x, w)| w * f(middle + half * x)).sum::<f64>();
    }
    sum * half
}

/// Integral of a density in a variable with a known quantile function, from the quantile of `row / rows` to that of
/// `(row + 1) / rows`. The last row reaches far where a lobe is narrow: it is split in halves of its share, down to
/// 1e-9 of the whole, which is left out.
pub fn integrate_row(
    row: usize,
    rows: usize,
    pieces: usize,
    quantile: &dyn Fn(f64) -> f64,
    f: &dyn Fn(f64) -> f64,
) -> f64 {
    let share = 1.0 / rows as f64;
    let from = row as f64 * share;
    if row + 1 < rows {
        return integrate(quantile(from), quantile(from + share), pieces, f);
    }
    let edge = |k: i32| quantile(1.0 - share * 0.5_f64.powi(k));
    (0..25).map(|k| integrate(edge(k), edge(k + 1), pieces, f)).sum()
}
