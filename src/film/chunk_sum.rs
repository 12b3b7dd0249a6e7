//! Sums over a chunk during rendering.

/// Four numbers per pixel, the last always 0: a contribution is then one 4-lane addition instead of three scalar ones.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChunkSum(pub Vec<[f64; 4]>);

impl ChunkSum {
    /// Zeros for `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self(vec![[0.0; 4]; pixels])
    }

    /// Adds one contribution, whose fourth number is 0.
    #[inline(always)]
    pub fn add(&mut self, pixel: usize, radiance: &[f32; 4]) {
        let sum = &mut self.0[pixel];
        for k in 0..4 {
            sum[k] += f64::from(radiance[k]);
        }
    }
}
