//! The rivals of lists (feature `rival`): every point walks down the tree of lights by itself, half as often as a list is long, with
//! independent numbers, and traces one ray to each light that it finds. For measurements only, and for `light` only.

use std::marker::PhantomData;

use super::walked::{Way, seen_from};
use super::{Chunk, Request, Scratch, Stage, pairs};
use crate::embree::TraceLane;
use crate::estimator::density::Mix;
use crate::lane::Mask;
use crate::light::tree::Digits;
use crate::pipeline::columns::CAPACITY;
use crate::pipeline::lists::Probed;

/// One light of its own for every point, some times.
pub struct PerRival<M>(PhantomData<M>);

impl<M: Probed> Stage for PerRival<M> {
    #[inline(always)]
    fn run<L: TraceLane>(chunk: &mut Chunk, scratch: &mut Scratch) {
        let Scratch { hits, aimed, set, .. } = scratch;
        let (Some(lists), Some(stream)) = (chunk.lists, M::stream(hits)) else {
            return;
        };
        let Some(guide) = &lists.guide else { return };
        let way = Way {
            lists,
            mix: Mix::Light,
            walks: (lists.length() / 2).max(1),
            table: None,
        };
        chunk.request(Request::All { set });
        let walks = way.walks as usize;
        for i in (0..walks).step_by(2) {
            for at in (0..stream.len()).step_by(L::N) {
                let (active, point, address) = stream.packet::<L>(at);
                let pair = |i: usize| chunk.numbers.pair(address.key, address.pass, pairs::light(i));
                let both = [active, active & L::Mask::splat(i + 1 < walks)];
                let digits = [i, (i + 1).min(walks - 1)].map(|i| Digits::<L>::new(pair(2 * i), 0, 1));
                let walked = lists.tree().guided(guide, both, seen_from::<L, M>(&point), digits);
                for (i, (active, walked)) in (i..walks).zip(both.into_iter().zip(&walked)) {
                    let active = active & walked.chance.gt(L::zero());
                    way.toward::<L, M>(chunk.world, (&point, &address), active, walked, pair(2 * i + 1), aimed);
                }
                if aimed.len() + 2 * L::N > CAPACITY {
                    chunk.request(Request::VisibleEach { queue: aimed, set });
                }
            }
            chunk.request(Request::VisibleEach { queue: aimed, set });
        }
    }
}
