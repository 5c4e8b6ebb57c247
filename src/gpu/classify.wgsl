// Which vertices may be removed now, as src/reduce/removal/{frame,view,snapshot}.rs have it.

// What is nearer to the eye counts as if it were so far.
const NEAR = 1024u;
const ERROR_BITS = 8u;

// The error that may be at a point.
fn allowed(point: vec3<i32>) -> u32 {
    let to = point - params.eye.xyz;
    let distance = square_root(dot_of(to, to));
    var error = shifted_down(unsigned_product(params.slope, max(distance, NEAR)), 24u - ERROR_BITS);
    let edge = unsigned_product(bitcast<u32>(params.forward.w), distance);
    if is_negative(plus(dot_of(to, params.forward.xyz), negated(edge))) {
        error = shifted_up(error, 3u);
    }
    return select(error.x, NOWHERE, error.y != 0u);
}

fn shortened(x: Wide, y: Wide, z: Wide) -> vec3<i32> {
    let length = wide_abs(x) | wide_abs(y) | wide_abs(z);
    let by = max(64u - leading_zeros(length), 20u) - 20u;
    return bitcast<vec3<i32>>(vec3<u32>(shifted_down(x, by).x, shifted_down(y, by).x, shifted_down(z, by).x));
}

// How far the neighbours of a vertex are from its tangent plane in the mean.
fn error_of(v: u32) -> u32 {
    let begin = rings[v];
    let end = rings[v + 1u];
    if begin == end {
        return 0u;
    }
    let origin = at(v);
    var largest = 0u;
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        largest |= magnitude(at(w.x) - origin) | magnitude(at(w.y) - origin);
    }
    let by = shift_of(largest);
    var x = Wide(0u);
    var y = Wide(0u);
    var z = Wide(0u);
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        let n = cross_of(shifted(at(w.x) - origin, by), shifted(at(w.y) - origin, by));
        x = plus(x, widened(n.x));
        y = plus(y, widened(n.y));
        z = plus(z, widened(n.z));
    }
    let normal = shortened(x, y, z);
    let length = square_root(dot_of(normal, normal));
    if length == 0u {
        return NOWHERE;
    }
    var off = Wide(0u);
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        off = plus(off, wide_abs(dot_of(normal, shifted(at(w.x) - origin, by))));
        off = plus(off, wide_abs(dot_of(normal, shifted(at(w.y) - origin, by))));
    }
    let mean = quotient(shifted_up(off, ERROR_BITS), 2u * (end - begin) * length);
    let error = shifted_up(Wide(mean, 0u), by);
    return select(error.x, NOWHERE, error.y != 0u);
}

@compute @workgroup_size(SIZE)
fn classify(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices {
        return;
    }
    // Those that moved in the iteration before are gone.
    var selected = params.iteration == 0u || (is_selected(v) && !is_moving(v));
    if selected {
        selected = !has_flag(v, STAYS) && !(params.is_seen != 0u && error_of(v) > allowed(at(v)));
    }
    state[v] = u32(selected);
}

@compute @workgroup_size(SIZE)
fn find_near(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices {
        return;
    }
    var near = false;
    if is_selected(v) {
        for (var k = rings[v]; k < rings[v + 1u] && !near; k += 1u) {
            let w = wing(k, v);
            near = !is_selected(w.x) || !is_selected(w.y);
        }
    }
    state[params.vertices + v] = u32(near);
}

// Whether it is auxiliary and no candidate itself.
fn waits(v: u32) -> bool {
    return is_selected(v) && has_flag(v, AUXILIARY) && !is_near(v);
}

@compute @workgroup_size(SIZE)
fn find_candidates(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices {
        return;
    }
    var candidate = is_near(v);
    if is_selected(v) && !candidate && params.rule != RULE_2015 && !has_flag(v, AUXILIARY) {
        for (var k = rings[v]; k < rings[v + 1u] && !candidate; k += 1u) {
            let w = wing(k, v);
            candidate = waits(w.x) || waits(w.y);
        }
    }
    state[2u * params.vertices + v] = u32(candidate);
    if candidate {
        count(CANDIDATES);
    }
}
