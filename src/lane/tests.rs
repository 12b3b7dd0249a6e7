//! Tests that every operation of `F32x8` has the same bits per lane as `f32`.

use super::*;

/// Ordinary numbers and edge cases.
fn hard_numbers() -> Vec<f32> {
    let mut numbers = vec![
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.5,
        1.5,
        2.5,
        -2.5,
        f32::MIN_POSITIVE,
        f32::from_bits(1),
        -f32::from_bits(1),
        f32::MAX,
        f32::MIN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        f32::EPSILON,
    ];
    let mut state = 1_u32;
    numbers.extend(
        std::iter::repeat_with(|| {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            f32::from_bits(state ^ state >> 13)
        })
        .take(111),
    );
    numbers
}

fn same(a: f32, b: f32) -> bool {
    a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan()
}

fn packets(numbers: &[f32]) -> impl Iterator<Item = [f32; 8]> + '_ {
    numbers.chunks_exact(8).map(|c| c.try_into().unwrap())
}

#[test]
fn eight_lanes_round_as_one_does() {
    let numbers = hard_numbers();
    for a in packets(&numbers) {
        for b in packets(&numbers) {
            let (wa, wb) = (F32x8::load(&a), F32x8::load(&b));
            type Case = (&'static str, F32x8, fn(f32, f32) -> f32);
            let results: [Case; 9] = [
                ("+", wa + wb, |a, b| a + b),
                ("-", wa - wb, |a, b| a - b),
                ("*", wa * wb, |a, b| a * b),
                ("/", wa / wb, |a, b| a / b),
                ("fma", wa.mul_add(wb, wa), |a, b| Lane::mul_add(a, b, a)),
                ("min", wa.min(wb), Lane::min),
                ("max", wa.max(wb), Lane::max),
                ("sqrt", wa.sqrt(), |a, _| Lane::sqrt(a)),
                ("neg", -wa, |a, _| -a),
            ];
            for (name, wide, scalar) in results {
                for i in 0..8 {
                    let expected = scalar(a[i], b[i]);
                    assert!(
                        same(wide.lane(i), expected),
                        "{name}({}, {}) = {expected}, not {}",
                        a[i],
                        b[i],
                        wide.lane(i)
                    );
                }
            }
            for (name, mask, scalar) in [
                ("lt", wa.lt(wb), (|a: f32, b: f32| a < b) as fn(f32, f32) -> bool),
                ("le", wa.le(wb), |a, b| a <= b),
                ("gt", wa.gt(wb), |a, b| a > b),
                ("ge", wa.ge(wb), |a, b| a >= b),
            ] {
                for i in 0..8 {
                    assert_eq!(
                        mask.to_bitmask() >> i & 1 == 1,
                        scalar(a[i], b[i]),
                        "{name}({}, {})",
                        a[i],
                        b[i]
                    );
                }
            }
        }
        let small: [f32; 8] = a.map(|x| if x.abs() < 1e9 { x } else { 7.5 });
        let w = F32x8::load(&small);
        for (i, &x) in small.iter().enumerate() {
            let whole = Lane::round(x);
            assert!(same(w.round().lane(i), whole));
            assert_eq!(w.round().to_i32().lane(i), whole.to_i32().0);
            assert!(same(
                F32x8::from_i32(w.to_bits()).lane(i),
                <f32 as Lane>::from_i32(Lane::to_bits(x))
            ));
        }
    }
}

#[test]
fn bits_wrap_alike() {
    let a = U32x8::from_fn(|i| 0x9e37_79b9_u32.wrapping_mul(i as u32 + 1));
    let b = U32x8::from_fn(|i| 0x85eb_ca6b_u32.wrapping_mul(i as u32 * 3 + 7));
    let table: [u32; 16] = std::array::from_fn(|i| 1000 + i as u32);
    for i in 0..8 {
        let (x, y) = (a.lane(i), b.lane(i));
        assert_eq!(U32x8::lookup(&table, a).lane(i), table[(x & 15) as usize]);
        assert_eq!((a + b).lane(i), x.wrapping_add(y));
        assert_eq!((a - b).lane(i), x.wrapping_sub(y));
        assert_eq!((a * b).lane(i), x.wrapping_mul(y));
        assert_eq!((a ^ b).lane(i), x ^ y);
        assert_eq!(a.shl(5).lane(i), x << 5);
        assert_eq!(a.shr(9).lane(i), x >> 9);
        assert_eq!(a.top_bit().to_bitmask() >> i & 1, x >> 31);
        assert_eq!(
            U32x8::select(Mask8::from_bitmask(0b1010_0110), a, b).lane(i),
            [y, x, x, y, y, x, y, x][i]
        );
    }
    assert_eq!(a.eq(U32x8::select(Mask8::first(3), a, b)).to_bitmask(), 0b111);
}

#[test]
fn rows_and_signs_are_those_of_each_lane() {
    fn check<L: Lane>() {
        let of = |k: usize| L::from_fn(|lane| (3 * lane + k) as f32 - 7.0);
        let rows = L::rows(of(0), of(1), of(2));
        for (lane, row) in rows.as_ref().iter().enumerate() {
            assert_eq!(*row, [of(0).lane(lane), of(1).lane(lane), of(2).lane(lane), 0.0]);
            let mask = L::Mask::from_bitmask(1 << lane);
            for other in 0..L::N {
                let sign = if other == lane { -1.0 } else { 1.0 };
                assert!(same(of(0).negated(mask).lane(other), sign * of(0).lane(other)));
            }
        }
        assert_eq!(rows.as_ref().len(), L::N);
        let number = |lane: usize, k: usize| (8 * lane + k) as u32;
        let columns = L::Bits::transposed(|lane| std::array::from_fn(|k| number(lane, k)));
        for (k, column) in columns.into_iter().enumerate() {
            assert!((0..L::N).all(|lane| column.lane(lane) == number(lane, k)), "column {k}");
        }
        assert!(same(L::zero().negated(L::Mask::splat(true)).lane(0), -0.0));
    }
    struct Check;
    impl Work for Check {
        #[inline(always)]
        fn run(self) {
            check::<F32x16>();
        }
    }
    check::<f32>();
    check::<F32x8>();
    if has_avx512() {
        with_avx512(Check);
    }
}

#[test]
fn packing_keeps_the_order_of_the_active_lanes() {
    let x = F32x8::from_fn(|i| i as f32);
    for m in 0..256_u32 {
        let mask = Mask8::from_bitmask(m);
        assert_eq!(mask.to_bitmask(), m);
        let packed = x.pack(F32x8::packing(mask));
        let lanes: Vec<usize> = mask.lanes().collect();
        assert_eq!(lanes.len(), mask.count());
        for (slot, lane) in lanes.iter().enumerate() {
            assert_eq!(packed.lane(slot), *lane as f32);
        }
        assert_eq!(Mask8::from_valid(mask.to_valid()).to_bitmask(), m);
    }
    for n in 0..12 {
        assert_eq!(Mask8::first(n).count(), n.min(8));
    }
}
