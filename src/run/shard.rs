//! Shards: a render split between processes by passes.

use std::ops::Range;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// One shard of a render: some of its passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u32,
    /// The number of shards.
    pub of: u32,
}

impl Shard {
    /// Its passes of `spp`: whole leaves of `leaf` passes, and the remainder after the last; empty if there are fewer leaves
    /// than shards.
    pub fn passes(self, spp: u32, leaf: u32) -> Range<u32> {
        let leaves = u64::from(spp.div_ceil(leaf));
        let end = |number: u32| {
            let leaves = leaves * u64::from(number) / u64::from(self.of);
            (leaves * u64::from(leaf)).min(spp.into()) as u32
        };
        end(self.number - 1)..end(self.number)
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').map(|(number, of)| (number.parse(), of.parse()));
        match parts {
            Some((Ok(number), Ok(of))) if 0 < number && number <= of => Ok(Self { number, of }),
            _ => Err("a shard is I/N, the first of seven being 1/7".to_owned()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_divide_the_passes_at_the_ends_of_leaves() {
        for (spp, leaf) in [(1, 16), (64, 16), (100, 16), (4096, 64), (1 << 30, 16)] {
            for of in [1, 2, 7, 64] {
                let mut end = 0;
                for number in 1..=of {
                    let passes = Shard { number, of }.passes(spp, leaf);
                    assert_eq!(passes.start, end);
                    assert!(passes.start.is_multiple_of(leaf) || passes.is_empty());
                    end = passes.end;
                }
                assert_eq!(end, spp);
            }
        }
    }

    #[test]
    fn a_shard_is_written_with_its_number_first() {
        assert_eq!("3/7".parse(), Ok(Shard { number: 3, of: 7 }));
        for text in ["", "3", "0/7", "8/7", "1/0", "-1/7", "1/7/2", "99999999999/7"] {
            assert!(text.parse::<Shard>().is_err(), "{text}");
        }
    }
}
