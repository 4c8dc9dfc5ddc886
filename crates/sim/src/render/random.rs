//! Numbers that look random and depend on nothing but what they are asked for, so that an image does not depend on which
//! thread computes which pixel.

/// One of 2^64 values for each input (the finaliser of `SplitMix64`, Steele et al. 2014).
pub(crate) fn hash(seed: u64, parts: &[u64]) -> u64 {
    parts.iter().fold(mix(seed), |state, &part| mix(state ^ part))
}

fn mix(value: u64) -> u64 {
    let z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// The upper bits of a hash as a number in 0..1.
pub(crate) fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 / (1_u64 << 53) as f64
}

/// The position `index` of an endless sequence that fills the unit square evenly from its start: the additive recurrence
/// with the plastic number (Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018).
pub(crate) fn evenly(index: usize, shift: [f64; 2]) -> [f64; 2] {
    let along = |step: f64, shift: f64| (shift + step * index as f64).fract();
    [
        along(0.754_877_666_246_692_8, shift[0]),
        along(0.569_840_290_998_053_2, shift[1]),
    ]
}
