//! The numbers of a picture: linear RGB in single precision, or in half precision if the picture is large and its file has no
//! more precision.

use half::f16;

/// Row by row from the top.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// In single precision: 12 bytes a texel.
    Single(Vec<[f32; 3]>),
    /// In half precision: 6 bytes a texel.
    Half(Vec<[f16; 3]>),
}

impl Texels {
    /// Number of texels.
    pub fn len(&self) -> usize {
        match self {
            Self::Single(texels) => texels.len(),
            Self::Half(texels) => texels.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The texel `index`, exactly converted to single precision.
    ///
    /// # Panics
    /// If there is no such texel.
    #[inline(always)]
    pub fn at(&self, index: usize) -> [f32; 3] {
        match self {
            Self::Single(texels) => texels[index],
            Self::Half(texels) => texels[index].map(f16::to_f32),
        }
    }

    /// All texels in order.
    pub fn iter(&self) -> impl Iterator<Item = [f32; 3]> + '_ {
        (0..self.len()).map(|index| self.at(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_same_numbers() {
        let numbers = [[0.0, 1.0, 0.099_975_586], [65504.0, 5.960_464_5e-8, 0.5]];
        let halves = Texels::Half(numbers.iter().map(|texel| texel.map(f16::from_f32)).collect());
        assert!(halves.iter().eq(Texels::Single(numbers.to_vec()).iter()));
    }
}
