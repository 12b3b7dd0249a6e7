//! Sums while a chunk is rendered.

/// Four numbers a pixel, of which the last is always 0: then a contribution is one addition of four lanes, not three of one.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ChunkSum(pub Vec<[f64; 4]>);

impl ChunkSum {
    /// Zero for `pixels` pixels.
    pub fn new(pixels: usize) -> Self {
        Self(vec![[0.0; 4]; pixels])
    }

    /// Adds one contribution, with a 0 behind it.
    #[inline(always)]
    pub fn add(&mut self, pixel: usize, radiance: &[f32; 4]) {
        let sum = &mut self.0[pixel];
        for k in 0..4 {
            sum[k] += f64::from(radiance[k]);
        }
    }
}
