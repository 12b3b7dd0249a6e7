//! The encoding of a picture for a page: half floats in tiles, only those that have changed.
//!
//! All numbers are little-endian. Five `u32`: layer, epoch, width, height, number of tiles; for each tile four `u16`: column,
//! row, width, height; then the radiances of the tiles in this order, row by row, `R G B` in half floats.

use std::sync::Arc;

use half::slice::HalfFloatSliceExt as _;

use super::board::Layer;

/// The side of a tile in pixels.
const SIDE: usize = 64;

/// Maximum side of a picture: tile coordinates are `u16`, and browsers would not draw more.
pub const LONGEST_SIDE: u32 = 16_384;

/// The message that updates a page to `layer`; `before` is the page's layer of the same epoch.
pub fn encode(epoch: u32, layer: &Layer, before: Option<&Arc<Layer>>) -> Vec<u8> {
    let (width, height) = (layer.picture.width as usize, layer.picture.height as usize);
    let same_size = |old: &&Arc<Layer>| (old.picture.width, old.picture.height) == (width as u32, height as u32);
    let (halves, before) = (layer.halves(), before.filter(same_size).map(|old| old.halves()));
    let row = |x: usize, y: usize, w: usize| 3 * (y * width + x)..3 * (y * width + x + w);
    let mut tiles = Vec::new();
    for y in (0..height).step_by(SIDE) {
        for x in (0..width).step_by(SIDE) {
            let (w, h) = (SIDE.min(width - x), SIDE.min(height - y));
            // Compare bits, so that NaN equals NaN.
            let same = |row: std::ops::Range<usize>| {
                before.is_some_and(|before| bits(&before[row.clone()]) == bits(&halves[row]))
            };
            if !(y..y + h).all(|y| same(row(x, y, w))) {
                tiles.push([x, y, w, h]);
            }
        }
    }
    let pixels: usize = tiles.iter().map(|[.., w, h]| w * h).sum();
    let mut message = Vec::with_capacity(20 + 8 * tiles.len() + 6 * pixels);
    let head = [layer.id.into(), epoch, width as u32, height as u32, tiles.len() as u32];
    head.iter()
        .for_each(|number: &u32| message.extend(number.to_le_bytes()));
    let table = tiles.iter().flatten();
    table.for_each(|&number| message.extend((number as u16).to_le_bytes()));
    for [x, y, w, h] in tiles {
        for y in y..y + h {
            // Every supported machine is little-endian.
            message.extend_from_slice(bytemuck::cast_slice(bits(&halves[row(x, y, w)])));
        }
    }
    message
}

fn bits(halves: &[half::f16]) -> &[u16] {
    halves.reinterpret_cast()
}

#[cfg(test)]
mod tests {
    use super::*;
    use octolux::film::Picture;

    fn layer(width: u32, height: u32, value: impl Fn(u32) -> f32) -> Arc<Layer> {
        let pixels = (0..width * height).map(|at| [value(at), 0.5, 2.0]).collect();
        Arc::new(Layer::new(3, Picture { width, height, pixels }))
    }

    #[test]
    fn the_first_message_holds_every_pixel_and_the_next_the_tiles_that_differ() {
        let first = layer(130, 65, |_| 1.0);
        let message = encode(7, &first, None);
        let tiles = 3 * 2;
        assert_eq!(message.len(), 20 + 8 * tiles + 6 * 130 * 65);
        assert_eq!(
            message[..20],
            *[3_u32, 7, 130, 65, 6].map(u32::to_le_bytes).as_flattened()
        );
        // The last pixel lies in the last tile, of 2 x 1.
        let second = layer(130, 65, |at| if at == 130 * 65 - 1 { 4.0 } else { 1.0 });
        let message = encode(7, &second, Some(&first));
        assert_eq!(message.len(), 20 + 8 + 6 * 2);
        assert_eq!(
            message[20..28],
            *[128_u16, 64, 2, 1].map(u16::to_le_bytes).as_flattened()
        );
        assert_eq!(message[34..36], half::f16::from_f32(4.0).to_le_bytes());
        assert_eq!(encode(7, &second, Some(&second)).len(), 20);
        let other_size = layer(65, 130, |_| 1.0);
        assert!(encode(7, &other_size, Some(&first)).len() > 6 * 65 * 130);
    }
}
