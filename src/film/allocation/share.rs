//! Divides a number of samples among pixels in proportion to weights, within bounds.

/// The weights of some pixels, and which of them are edges.
#[derive(Debug, Default)]
pub(super) struct Weights {
    pub weights: Vec<f64>,
    pub edges: Vec<bool>,
}

/// The least shares of pixels, and of edges, and the largest share of any.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub least: u64,
    pub of_edges: u64,
    pub most: u64,
}

impl Weights {
    /// Divides `total` in proportion to the weights, with each share clamped to its bounds: `clamp(scale * weight)` with the one scale
    /// that spends exactly `total`. Shares are rounded so that every prefix sum is accurate to one. `total` must be at least the sum of
    /// the least shares, and at most `most` times the number of shares.
    pub fn apportion(&self, total: u64, bounds: Bounds) -> Vec<u32> {
        let Self { weights, edges } = self;
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        // Keeps every pixel within reach of a finite scale, and makes pixels without noise share equally.
        let sure = if mean > 0.0 { mean * 1e-4 } else { 1.0 };
        let (least, of_edges, high) = (bounds.least as f64, bounds.of_edges as f64, bounds.most as f64);
        let share = |scale: f64, weight: f64, edge: bool| {
            (scale * weight.max(sure)).clamp(if edge { of_edges } else { least }, high)
        };
        // Eight parallel sums, which the compiler vectorizes.
        let spent = |scale: f64| {
            let ((eights, rest), (lows, low)) = (weights.as_chunks::<8>(), edges.as_chunks::<8>());
            let mut sums = [0.0; 8];
            for (eight, lows) in eights.iter().zip(lows) {
                for ((sum, &weight), &low) in sums.iter_mut().zip(eight).zip(lows) {
                    *sum += share(scale, weight, low);
                }
            }
            let rest = rest.iter().zip(low).map(|(&weight, &low)| share(scale, weight, low));
            sums.iter().sum::<f64>() + rest.sum::<f64>()
        };
        // Right without bounds; the floor makes it less.
        let guess = total as f64 / (mean.max(sure) * weights.len() as f64);
        let scale = solve(|scale| spent(scale) - total as f64, guess, high / sure);
        let (mut sum, mut given) = (0.0, 0);
        let mut shares: Vec<u32> = Vec::with_capacity(weights.len());
        for (&weight, &edge) in weights.iter().zip(edges) {
            sum += share(scale, weight, edge);
            let upto = sum.round() as u64;
            shares.push((upto - given) as u32);
            given = upto;
        }
        // Beyond 2^50 samples the sums above are themselves rounded; the last pixel takes the difference.
        if let Some(last) = shares.last_mut() {
            *last = (u64::from(*last) + total).saturating_sub(given) as u32;
        }
        shares
    }
}

/// Within this of 0, [`solve`] is done: a quarter of a pair of samples, of all pixels together.
const CLOSE: f64 = 0.25;

/// Where `off`, which never falls, is next to 0: by bisection of 0 to `most`, which begins at `guess`.
///
/// Most of its steps need no value of `off`, since secants first find places close to the root on both sides: with a film of 393 216
/// pixels 10 values instead of 45. The result is that of bisection alone, as also rounded sums of rounded shares never fall.
fn solve(off: impl Fn(f64) -> f64, guess: f64, most: f64) -> f64 {
    // The closest places known to be too low and too high.
    let (mut low, mut high) = (0.0, most);
    let look = |scale: f64, low: &mut f64, high: &mut f64| {
        let found = off(scale);
        if found <= -CLOSE {
            *low = scale.max(*low);
        } else if found >= CLOSE {
            *high = scale.min(*high);
        }
        found
    };
    let (mut a, mut b) = (guess, 0.75 * guess);
    let mut at_a = look(a, &mut low, &mut high);
    for _ in 0..12 {
        let at_b = look(b, &mut low, &mut high);
        let slope = (at_b - at_a) / (b - a);
        if slope.is_nan() || slope <= 0.0 {
            break;
        }
        if at_b.abs() < 4.0 * CLOSE {
            // Just outside of what is close, on both sides.
            for aim in [-1.5 * CLOSE, 1.5 * CLOSE] {
                look(b + (aim - at_b) / slope, &mut low, &mut high);
            }
            break;
        }
        let next = b - at_b / slope;
        (a, at_a) = (b, at_b);
        b = if next > low && next < high {
            next
        } else {
            low.midpoint(high)
        };
    }
    let (mut below, mut above, mut scale) = (0.0, most, guess);
    for _ in 0..100 {
        let found = if scale <= low {
            -1.0
        } else if scale >= high {
            1.0
        } else {
            look(scale, &mut low, &mut high)
        };
        if found.abs() < CLOSE {
            break;
        }
        *(if found > 0.0 { &mut above } else { &mut below }) = scale;
        scale = below.midpoint(above);
    }
    scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secants_lead_where_bisection_does() {
        let bisected = |off: &dyn Fn(f64) -> f64, guess: f64, most: f64| {
            let (mut below, mut above, mut scale) = (0.0, most, guess);
            for _ in 0..100 {
                let found = off(scale);
                if found.abs() < CLOSE {
                    break;
                }
                *(if found > 0.0 { &mut above } else { &mut below }) = scale;
                scale = below.midpoint(above);
            }
            scale
        };
        for total in [1e3, 1e5, 2e7] {
            for bend in 0..40 {
                // Many flats and bends: as many as there are weights.
                let weight = |i: i32| (f64::from(bend) * 0.1 * f64::from(i % 17) - 2.0).exp();
                let calls = std::cell::Cell::new(0);
                let off = |scale: f64| {
                    calls.set(calls.get() + 1);
                    let sum: f64 = (0..200).map(|i| (scale * weight(i)).clamp(2.0, total / 10.0)).sum();
                    sum - total
                };
                let mean = (0..200).map(weight).sum::<f64>() / 200.0;
                let (guess, most) = (total / (200.0 * mean), total / (mean * 1e-5));
                let expected = bisected(&off, guess, most);
                let alone = calls.replace(0);
                assert_eq!(solve(off, guess, most).to_bits(), expected.to_bits(), "{total}, {bend}");
                assert!(
                    calls.get() <= alone.max(20),
                    "{} values instead of {alone}",
                    calls.get()
                );
            }
        }
    }
}
