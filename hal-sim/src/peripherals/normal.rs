//! Normal deviates, equal to the last bit on every machine: the ziggurat of Doornik (2005) with 256 layers, its functions by `libm`.
//!
//! Generator, tables and order of the draws are those of `StandardNormal` of `rand_distr`, which takes exp and ln from the C library of the
//! system. The deviates agree with it to 1e-13 (test below).

use rand_xoshiro::rand_core::Rng;
use std::sync::LazyLock;

/// Start of the tail, and area of each layer (Doornik, 256 layers).
const TAIL: f64 = 3.654_152_885_361_009;
const LAYER_AREA: f64 = 0.004_928_673_233_99;
const LAYERS: usize = 256;

/// Edges of the layers, from outside inwards, and the density there.
struct Layers {
    edge: [f64; LAYERS + 1],
    density: [f64; LAYERS + 1],
}

/// exp(−x²/2): the density without its factor.
fn density(x: f64) -> f64 {
    libm::exp(-0.5 * x * x)
}

static LAYER: LazyLock<Layers> = LazyLock::new(|| {
    let mut edge = [0.0; LAYERS + 1];
    edge[0] = LAYER_AREA / density(TAIL);
    edge[1] = TAIL;
    for k in 2..LAYERS {
        edge[k] = (-2.0 * libm::log(LAYER_AREA / edge[k - 1] + density(edge[k - 1]))).sqrt();
    }
    Layers { density: edge.map(density), edge }
});

/// 52 bits as a number in [0, 1).
fn fraction(bits: u64) -> f64 {
    (bits >> 12) as f64 / (1_u64 << 52) as f64
}

/// The next standard normal deviate.
pub fn standard_normal(generator: &mut impl Rng) -> f64 {
    let layers = &*LAYER;
    loop {
        let bits = generator.next_u64();
        let layer = bits as usize & (LAYERS - 1);
        let side = 2.0 * fraction(bits) - 1.0;
        let x = side * layers.edge[layer];
        if x.abs() < layers.edge[layer + 1] {
            return x;
        }
        if layer == 0 {
            return tail(generator, side);
        }
        let height = (generator.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        if layers.density[layer + 1] + (layers.density[layer] - layers.density[layer + 1]) * height < density(x) {
            return x;
        }
    }
}

/// A deviate beyond [`TAIL`] (Marsaglia).
fn tail(generator: &mut impl Rng, side: f64) -> f64 {
    // Open interval: 0 would have no logarithm.
    let mut logarithm = || libm::log(fraction(generator.next_u64()) + 0.5 * f64::EPSILON);
    loop {
        let (x, y) = (logarithm() / TAIL, logarithm());
        if -2.0 * y >= x * x {
            return if side < 0.0 { x - TAIL } else { TAIL - x };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution, StandardNormal};
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::SeedableRng;

    #[test]
    fn the_deviates_are_those_of_rand_distr() {
        let (mut own, mut other) = (Xoshiro256PlusPlus::seed_from_u64(7), Xoshiro256PlusPlus::seed_from_u64(7));
        let mut in_tail = 0;
        for k in 0..3_000_000 {
            let (found, expected): (f64, f64) = (standard_normal(&mut own), StandardNormal.sample(&mut other));
            assert!((found - expected).abs() < 1e-13, "{k}: {found} {expected}");
            in_tail += u32::from(found.abs() > TAIL);
        }
        // P(|x| > 3.654) = 2.58e-4.
        assert!((600..950).contains(&in_tail), "{in_tail}");
    }
}
