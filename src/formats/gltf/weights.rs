//! Weights of joints that sum up to 1, as glTF wants them (2.0, §3.7.3.1), whatever quantisation has made of them.

use super::accessor::Shape;
use crate::mesh::attributes::Values;

/// Has the weights of each vertex, over all sets, sum up to 1: as integers exactly, as binary32 numbers to within a rounding. Those of which
/// the sum is 0 or no number stay as they are.
pub(super) fn normalise(sets: &mut [(Shape, &mut Values)]) {
    let Some(count) = sets.iter().map(|(shape, values)| values.len() / shape.components.max(1)).min() else {
        return;
    };
    let units: Vec<f64> = sets
        .iter()
        .map(|(shape, _)| shape.stored.one().filter(|_| shape.normalised).unwrap_or(1.0))
        .collect();
    // What one set counts in another may be no whole number there.
    let is_one_kind = units.windows(2).all(|pair| pair[0] == pair[1]);
    let Some(&one) = units.first().filter(|_| is_one_kind) else { return };
    let mut made: Vec<Values> = sets.iter().map(|(shape, _)| Values::new(shape.stored)).collect();
    for v in 0..count {
        let mut weights: Vec<f64> = Vec::new();
        for (shape, values) in sets.iter() {
            weights.extend((0..shape.components).map(|k| values.number(v * shape.components + k).max(0.0)));
        }
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 && sum.is_finite() {
            let rounded = |x: f64| if one > 1.0 { x.round() } else { f64::from(x as f32) };
            weights.iter_mut().for_each(|weight| *weight = rounded(*weight / sum * one));
            // The largest takes what rounding has left over.
            let largest = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b])).unwrap_or(0);
            let others: f64 =
                weights.iter().enumerate().filter(|(k, _)| *k != largest).map(|(_, weight)| weight).sum();
            weights[largest] = one - others;
        }
        let mut weights = weights.into_iter();
        for ((shape, _), made) in sets.iter().zip(&mut made) {
            weights.by_ref().take(shape.components).for_each(|weight| made.push(weight));
        }
    }
    sets.iter_mut().zip(made).for_each(|((_, values), made)| **values = made);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::Stored;

    #[test]
    fn weights_sum_up_to_1() {
        let shape = |stored, normalised| Shape { stored, normalised, components: 4 };
        let mut bytes = Values::U8(vec![100, 100, 55, 1, 0, 0, 0, 0]);
        // 255/256 of each round to what they were: the last of the largest gives 1.
        normalise(&mut [(shape(Stored::U8, true), &mut bytes)]);
        assert_eq!(bytes, Values::U8(vec![100, 99, 55, 1, 0, 0, 0, 0]));
        let mut floats = [Values::F32(vec![0.7, 0.2, 0.0, 0.0]), Values::F32(vec![0.2, 0.0, 0.0, 0.0])];
        let [first, second] = &mut floats;
        normalise(&mut [(shape(Stored::F32, false), first), (shape(Stored::F32, false), second)]);
        let numbers = |values: &Values| (0..4).map(|k| values.number(k) as f32).collect::<Vec<_>>();
        let all = [numbers(&floats[0]), numbers(&floats[1])].concat();
        assert_eq!(all.iter().sum::<f32>(), 1.0);
        assert!((all[0] - 0.7 / 1.1).abs() < 1e-6 && all[1] == all[4] && all[2] == 0.0, "{all:?}");
    }
}
