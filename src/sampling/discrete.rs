//! Samples a discrete distribution with a 32-bit number: a cumulative sum with a guide table.
//!
//! Probabilities are multiples of 2^-32. So the reported probability is exactly that of the sampling, and the remainder of the
//! number is uniform again. A guide with as many cells as items (Chen and Asau 1974, "On Generating Random Variates from an
//! Empirical Distribution") limits the search to a step or two on average, however many items there are.

/// A distribution over `0..n`.
#[derive(Clone, Debug)]
pub struct Discrete {
    /// Items up to and including `i` have the numbers below `ends[i]`; the last is 2^32.
    ends: Vec<u64>,
    /// For each cell of numbers, the item of its first number.
    guide: Vec<u32>,
    /// Shift from a number to its cell.
    shift: u32,
}

impl Discrete {
    /// In proportion to `weights`, which are finite and nonnegative. Every item with a positive weight can be sampled. `None` if
    /// all weights are 0, or more than 2^24 are positive.
    pub fn new(weights: &[f64]) -> Option<Self> {
        let total: f64 = weights.iter().sum();
        let some = weights.iter().filter(|&&w| w > 0.0).count() as u64;
        if some == 0 || some > 1 << 24 {
            return None;
        }
        let shared = ((1_u64 << 32) - some) as f64;
        let (mut sum, mut before, mut ends) = (0.0, 0, Vec::with_capacity(weights.len()));
        for weight in weights {
            sum += weight;
            before += u64::from(*weight > 0.0);
            ends.push((sum / total * shared).round().min(shared) as u64 + before);
        }
        let bits = weights.len().next_power_of_two().trailing_zeros();
        let shift = 32 - bits;
        let mut thing = 0;
        let guide = (0..1_u64 << bits).map(|cell| {
            while ends[thing] <= cell << shift {
                thing += 1;
            }
            thing as u32
        });
        let guide = guide.collect();
        Some(Self { ends, guide, shift })
    }

    /// The item of `number`, and the position of the number within the item's range, in [0, 1).
    #[inline(always)]
    pub fn pick(&self, number: u32) -> (u32, f32) {
        let number = u64::from(number);
        let mut thing = self.guide[(number >> self.shift) as usize] as usize;
        while self.ends[thing] <= number {
            thing += 1;
        }
        let start = self.start(thing);
        let place = (number - start) as f32 / (self.ends[thing] - start) as f32;
        (thing as u32, place.min(1.0 - f32::EPSILON / 2.0))
    }

    /// The probability of `thing`.
    #[inline(always)]
    pub fn chance(&self, thing: u32) -> f32 {
        let thing = thing as usize;
        (self.ends[thing] - self.start(thing)) as f32 * (1.0 / 4_294_967_296.0)
    }

    #[inline(always)]
    fn start(&self, thing: usize) -> u64 {
        if thing == 0 { 0 } else { self.ends[thing - 1] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every probability is its weight to within 2^-32 per item. Exactly the numbers of its range sample an item.
    #[test]
    fn shares_are_the_weights_and_numbers_find_their_things() {
        let many: Vec<f64> = (0..1000).map(|i| f64::from((i * 7919) % 13)).collect();
        for weights in [vec![1.0], vec![0.0, 3.0, 1e-30, 1.0, 0.0], vec![1e-300, 2e-300], many] {
            let table = Discrete::new(&weights).unwrap();
            let total: f64 = weights.iter().sum();
            let mut sum = 0.0;
            for (i, weight) in weights.iter().enumerate() {
                let (chance, share) = (f64::from(table.chance(i as u32)), weight / total);
                assert!((chance - share).abs() <= (weights.len() + 1) as f64 / 4_294_967_296.0 + 6e-8 * share);
                assert_eq!(*weight > 0.0, chance > 0.0);
                sum += chance;
                if *weight > 0.0 {
                    let (first, last) = (table.start(i), table.ends[i] - 1);
                    assert_eq!(table.pick(first as u32), (i as u32, 0.0));
                    let (thing, place) = table.pick(last as u32);
                    assert!(thing == i as u32 && (0.0..1.0).contains(&place));
                    assert!(first == 0 || table.pick(first as u32 - 1).0 < i as u32);
                }
            }
            assert!((sum - 1.0).abs() < 1e-6 && *table.ends.last().unwrap() == 1 << 32);
        }
        assert!(Discrete::new(&[]).is_none() && Discrete::new(&[0.0, 0.0]).is_none());
    }
}
