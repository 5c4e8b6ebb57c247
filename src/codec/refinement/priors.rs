//! What is known of decisions beforehand: how a fresh model stands (spec §5.5.2, §5.5.3).
//!
//! Fitted, by logistic regression, to the decisions of 21 meshes: scans, CAD, characters, generated ones; how much is gained by it was
//! looked at on others. Each part of a context contributes to the odds on a no, in units of 1/16 of their logarithm.

use crate::codec::context::{ANGLES, BENDS, REACHES};
use crate::codec::extents::CLASSES;
use crate::entropy::Bit;
use crate::entropy::mix::curve;

/// A model that has learnt from six decisions, as it were.
pub const fn known(odds: i32) -> Bit {
    Bit::known(curve(16 * odds), 6)
}

/// By kind, how many sides are closed, class of the length beside others.
pub const fn beside() -> [[[Bit; CLASSES]; 8]; 2] {
    let mut models = [[[Bit::NEW; CLASSES]; 8]; 2];
    let mut place = 0;
    while place < 2 * 5 * 20 {
        let (kind, closed, class) = (place / 100, place / 20 % 5, place % 20);
        models[kind][closed][class] = known(CLOSED[kind][closed] + CLASS[class]);
        place += 1;
    }
    models
}

const CLOSED: [[i32; 5]; 2] = [[15, 22, 31, 38, 20], [14, 24, 41, 0, 0]];
const CLASS: [i32; 20] = [15, 23, 26, 26, 25, 24, 23, 22, 18, 15, 11, 6, -4, -11, -17, -12, -12, -10, -1, 4];

/// The same with the angle.
pub const fn angles() -> [[[[Bit; CLASSES]; ANGLES / 2]; 8]; 2] {
    let mut models = [[[[Bit::NEW; CLASSES]; ANGLES / 2]; 8]; 2];
    let mut place = 0;
    while place < 2 * 5 * 16 * 20 {
        let (kind, closed, angle, class) = (place / 1600, place / 320 % 5, place / 20 % 16, place % 20);
        models[kind][closed][angle][class] =
            known(RICH_CLOSED[kind][closed] + SPLIT_ANGLE[angle] + RICH_CLASS[class]);
        place += 1;
    }
    models
}

const RICH_CLOSED: [[i32; 5]; 2] = [[10, 17, 26, 34, 16], [10, 18, 36, 0, 0]];
const SPLIT_ANGLE: [i32; 16] = [7, 7, 8, 7, 6, 5, 4, 5, 6, 6, 4, 3, 4, 8, 12, 7];
const RICH_CLASS: [i32; 20] =
    [10, 16, 20, 20, 21, 20, 21, 19, 17, 14, 11, 6, -4, -12, -17, -13, -14, -12, -3, 4];

/// By how many edges the ends of an edge have, and the vertices opposite to it, and half the class of its length.
pub const fn split_valences() -> [[[Bit; 16]; 16]; 16] {
    let mut models = [[[Bit::NEW; 16]; 16]; 16];
    let mut place = 0;
    while place < 1000 {
        let (ends, far, class) = (place / 100, place / 10 % 10, place % 10);
        models[ends][far][class] = known(SPLIT_ENDS[ends] + SPLIT_FAR[far] + HALF_CLASS[class]);
        place += 1;
    }
    models
}

const SPLIT_ENDS: [i32; 10] = [38, 22, 23, 23, 20, 11, 4, 1, 3, 21];
const SPLIT_FAR: [i32; 10] = [-3, 5, 6, 6, 6, 8, 11, 13, 13, 4];
const HALF_CLASS: [i32; 10] = [11, 22, 21, 20, 14, 7, -7, -15, -10, -3];

/// By how many more edges p and q have than v and r, and the angle; where in the star the edge is makes no difference beforehand.
pub const fn shape() -> [[[[Bit; ANGLES / 4]; 4]; 4]; 8] {
    let mut models = [[[[Bit::NEW; ANGLES / 4]; 4]; 4]; 8];
    let mut place = 0;
    while place < EXCESSES as usize * 8 {
        let (excess, angle) = (place / 8, place % 8);
        let fresh = known(EXCESS[excess] + ANGLE[angle]);
        let mut at = 0;
        while at < 3 * 4 {
            models[excess][at / 4][at % 4][angle] = fresh;
            at += 1;
        }
        place += 1;
    }
    models
}

/// Classes of how many more edges p and q have.
pub const EXCESSES: i32 = 8;
const EXCESS: [i32; EXCESSES as usize] = [36, 42, 39, 32, 25, 18, 9, -2];
const ANGLE: [i32; 8] = [-52, -37, -22, -10, 4, 21, 41, 50];

/// By how many edges p and q have, and r, and flips before.
pub const fn flip_valences() -> [[[Bit; 4]; 8]; 16] {
    let mut models = [[[Bit::NEW; 4]; 8]; 16];
    let mut place = 0;
    while place < ENDS as usize * 32 {
        let (ends, far, flips) = (place / 32, place / 4 % 8, place % 4);
        models[ends][far][flips] = known(FLIP_ENDS[ends] + FLIP_FAR[far] + FLIPS[flips]);
        place += 1;
    }
    models
}

/// Classes of how many edges p and q have.
pub const ENDS: i32 = 12;
const FLIP_ENDS: [i32; ENDS as usize] = [6, 12, 46, 47, 40, 30, 21, 12, 2, -3, -6, -1];
const FLIP_FAR: [i32; 8] = [-25, -14, -6, 11, 17, 21, 18, 12];
const FLIPS: [i32; 4] = [-5, 10, 35, 18];

/// By bend and angle, wherever in the star.
pub const fn rich_shape() -> [[[Bit; ANGLES]; 8]; 4] {
    let mut models = [[[Bit::NEW; ANGLES]; 8]; 4];
    let mut place = 0;
    while place < 3 * BENDS * ANGLES {
        let (end, bend, angle) = (place / (BENDS * ANGLES), place / ANGLES % BENDS, place % ANGLES);
        models[end][bend][angle] = known(RICH_BEND[bend] + RICH_ANGLE[angle]);
        place += 1;
    }
    models
}

const RICH_BEND: [i32; BENDS] = [12, 20, 25, 32, 14];
const RICH_ANGLE: [i32; ANGLES] = [
    -66, -56, -60, -55, -49, -44, -40, -40, -33, -28, -23, -20, -17, -15, -13, -12, -6, 3, 6, 11, 15, 19, 24,
    32, 39, 43, 52, 58, 57, 62, 58, 59,
];

/// By flips before, edges closed beyond, reach and half the class of the angle.
pub const fn reach() -> [[[[Bit; ANGLES / 2]; 16]; 4]; 4] {
    let mut models = [[[[Bit::NEW; ANGLES / 2]; 16]; 4]; 4];
    let mut place = 0;
    while place < 4 * 3 * REACHES * 16 {
        let (angle, reach) = (place % 16, place / 16 % REACHES);
        let (flips, closed) = (place / (3 * REACHES * 16), place / (REACHES * 16) % 3);
        models[flips][closed][reach][angle] =
            known(FLIPS_AND_BEYOND[flips][closed] + REACH[reach] + REACH_ANGLE[angle]);
        place += 1;
    }
    models
}

const FLIPS_AND_BEYOND: [[i32; 3]; 4] = [[2, 4, 0], [14, 18, 17], [36, 34, 35], [13, 14, 15]];
const REACH: [i32; REACHES] = [19, 16, 11, 8, 6, -2, -5, -7, -3, 0, 5, 14];
const REACH_ANGLE: [i32; 16] = [-59, -59, -49, -41, -30, -19, -9, -6, 6, 18, 27, 36, 45, 50, 48, 47];
