//! Chi-square tests of counts, and quadrature.

pub use octolux::study::distributions::{p_chi_square, p_student};

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
