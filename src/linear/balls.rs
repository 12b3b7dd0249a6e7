//! Spheres in columns, from which tests select some: those that stay are moved together without branches, which would be mispredicted.

use crate::lane::{Bits, F32x8, Lane, Mask};
use crate::math::Vec3;

/// Lanes of a packet.
type Lanes = F32x8;
type Numbers = <Lanes as Lane>::Bits;
type Kept = <Lanes as Lane>::Mask;

/// A packet of spheres.
#[derive(Clone, Copy)]
pub struct Packet {
    /// Indices in the scene.
    pub numbers: Numbers,
    pub center: Vec3<Lanes>,
    pub radius: Lanes,
}

impl Packet {
    /// Centers and radii.
    pub fn ball(&self) -> (Vec3<Lanes>, Lanes) {
        (self.center, self.radius)
    }
}

/// Some spheres of a scene.
#[derive(Clone, Debug, Default)]
pub struct Balls {
    count: usize,
    /// Indices in the scene; those behind the first `count` mean nothing, nor do those columns.
    numbers: Vec<u32>,
    /// Center and radius of each, with room for a packet behind them; or nothing, if only the indices are known.
    columns: [Vec<f32>; 4],
}

impl PartialEq for Balls {
    /// The indices tell the rest.
    fn eq(&self, other: &Self) -> bool {
        self.numbers() == other.numbers()
    }
}

impl Balls {
    /// Number of spheres.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether centers and radii are known.
    pub fn is_known(&self) -> bool {
        !self.columns[0].is_empty()
    }

    /// Indices in the scene.
    pub fn numbers(&self) -> &[u32] {
        &self.numbers[..self.count]
    }

    /// Removes all spheres.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds spheres of which only the indices are known.
    pub fn extend(&mut self, numbers: impl Iterator<Item = u32>) {
        self.numbers.truncate(self.count);
        self.numbers.extend(numbers);
        self.count = self.numbers.len();
        self.columns.iter_mut().for_each(Vec::clear);
    }

    /// Adds the spheres of a packet that a test kept.
    pub fn append(&mut self, kept: Kept, packet: &Packet) {
        self.make_room(self.count);
        self.count = self.write(self.count, kept, packet);
    }

    /// Those of other spheres that a test keeps.
    #[inline(always)]
    pub fn select(&mut self, of: &Self, keep: impl Fn(&Packet) -> Kept) {
        self.make_room(of.count);
        let mut count = 0;
        for at in (0..of.count).step_by(Lanes::N) {
            let packet = of.packet(at);
            count = self.write(count, Kept::first(of.count - at) & keep(&packet), &packet);
        }
        self.count = count;
    }

    /// Removes the spheres that a test does not keep.
    #[inline(always)]
    pub fn retain(&mut self, keep: impl Fn(&Packet) -> Kept) {
        let mut count = 0;
        // A packet is read before it is overwritten.
        for at in (0..self.count).step_by(Lanes::N) {
            let packet = self.packet(at);
            count = self.write(count, Kept::first(self.count - at) & keep(&packet), &packet);
        }
        self.count = count;
    }

    /// Room to write a packet behind the first `count` spheres, and to read one from any of those that there are then.
    fn make_room(&mut self, count: usize) {
        let room = count + 2 * Lanes::N;
        if self.numbers.len() < room {
            self.numbers.resize(room, 0);
        }
        for column in &mut self.columns {
            if column.len() < room {
                column.resize(room, 0.0);
            }
        }
    }

    #[inline(always)]
    fn packet(&self, at: usize) -> Packet {
        let column = |k: usize| Lanes::load(&self.columns[k][at..]);
        Packet {
            numbers: Numbers::load(&self.numbers[at..]),
            center: Vec3::new(column(0), column(1), column(2)),
            radius: column(3),
        }
    }

    /// Writes the kept spheres behind the first `count`, and returns how many there are then.
    #[inline(always)]
    fn write(&mut self, count: usize, kept: Kept, packet: &Packet) -> usize {
        let packing = Lanes::packing(kept);
        let Packet {
            numbers,
            center,
            radius,
        } = *packet;
        let numbers = Lanes::from_bits(numbers).pack(packing).to_bits();
        numbers.store(&mut self.numbers[count..]);
        for (column, number) in self.columns.iter_mut().zip([center.x, center.y, center.z, radius]) {
            number.pack(packing).store(&mut column[count..]);
        }
        count + kept.count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn odd(packet: &Packet) -> Kept {
        (packet.numbers & Numbers::splat(1)).eq(Numbers::splat(1))
    }

    /// Whatever their number, spheres stay in order, each with its own center and radius.
    #[test]
    fn kept_spheres_move_together() {
        for count in 0..40 {
            let (mut all, mut apart) = (Balls::default(), Balls::default());
            for at in (0..count).step_by(Lanes::N) {
                let numbers = Numbers::from_fn(|lane| (at + lane) as u32);
                let radius = Lanes::from_i32(numbers);
                let packet = Packet {
                    numbers,
                    center: Vec3::new(radius, -radius, radius + radius),
                    radius,
                };
                all.append(Kept::first(count - at), &packet);
                apart.append(Kept::first(count - at) & odd(&packet), &packet);
            }
            let expected: Vec<u32> = (0..count as u32).collect();
            assert_eq!(all.numbers(), expected);
            let mut some = Balls::default();
            some.select(&all, odd);
            all.retain(odd);
            apart.retain(odd);
            for balls in [&some, &all, &apart] {
                let of = expected.iter().copied().filter(|number| number % 2 == 1);
                assert_eq!(balls.numbers(), of.collect::<Vec<_>>());
                for (at, &number) in balls.numbers().iter().enumerate() {
                    let x = number as f32;
                    let found: Vec<f32> = balls.columns.iter().map(|column| column[at]).collect();
                    assert_eq!(found, [x, -x, x + x, x]);
                }
            }
        }
    }
}
