// Moves that do not go together are called off, the next mesh is made, and looked at, as src/reduce/removal/{veto,frame,snapshot}.rs have it.

// Iterations in which the dearest loses.
const FAIR = 2u;

fn is_mover(v: u32) -> bool {
    return target_of(v) != NOWHERE;
}

// Grows with what a move costs, later by chance; then with the number.
fn rank_of(v: u32) -> vec2<u32> {
    if params.iteration < FAIR {
        return vec2<u32>(cost_of(v), v);
    }
    return vec2<u32>(mixed(v, params.iteration), v);
}

// Whether a triangle, least vertex in front, turns over if this set of its corners moves.
fn turns_over(corners: vec3<u32>, moving: u32, old: vec3<i32>) -> bool {
    var after = corners;
    for (var k = 0u; k < 3u; k += 1u) {
        if ((moving >> k) & 1u) != 0u {
            after[k] = target_of(corners[k]);
        }
    }
    if after.x == after.y || after.y == after.z || after.z == after.x {
        return false;
    }
    return !keeps_side(old, normal_of(at(after.x), at(after.y), at(after.z)));
}

// Calls off moves until no triangle turns over, whichever of the rest are carried out.
@compute @workgroup_size(SIZE)
fn veto(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = number_of(id, groups);
    if t >= params.triangles {
        return;
    }
    var corners = mesh[t].xyz;
    let least = min(corners.x, min(corners.y, corners.z));
    if corners.y == least {
        corners = corners.yzx;
    } else if corners.z == least {
        corners = corners.zxy;
    }
    var movers = 0u;
    for (var k = 0u; k < 3u; k += 1u) {
        movers |= u32(is_mover(corners[k])) << k;
    }
    if countOneBits(movers) < 2u {
        return;
    }
    let old = normal_of(at(corners.x), at(corners.y), at(corners.z));
    // Each time one mover less is left.
    for (var turn = 0u; turn < 3u; turn += 1u) {
        var found = 0u;
        for (var some = 1u; some < 8u && found == 0u; some += 1u) {
            if (some & movers) == some && turns_over(corners, some, old) {
                found = some;
            }
        }
        if found == 0u {
            return;
        }
        var dearest = 3u;
        var rank = vec2<u32>(0u);
        for (var k = 0u; k < 3u; k += 1u) {
            if ((found >> k) & 1u) != 0u {
                let own = rank_of(corners[k]);
                if dearest == 3u || is_before(rank, own) {
                    dearest = k;
                    rank = own;
                }
            }
        }
        atomicStore(&marks[corners[dearest]], 1u);
        movers &= ~(1u << dearest);
    }
}

// Calls off the moves that are not the cheapest among neighbours.
@compute @workgroup_size(SIZE)
fn compare(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices || !is_mover(v) {
        return;
    }
    let own = vec2<u32>(cost_of(v), v);
    for (var k = rings[v]; k < rings[v + 1u]; k += 1u) {
        let w = wing(k, v);
        if is_cheaper(w.x, own) || is_cheaper(w.y, own) {
            atomicStore(&marks[v], 1u);
            return;
        }
    }
}

fn is_cheaper(w: u32, own: vec2<u32>) -> bool {
    return is_mover(w) && is_before(vec2<u32>(cost_of(w), w), own);
}

@compute @workgroup_size(SIZE)
fn find_moving(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices {
        return;
    }
    let moving = is_mover(v) && atomicLoad(&marks[v]) == 0u && params.patience != PATIENCE_STILL;
    state[3u * params.vertices + v] = u32(moving);
    if moving {
        count(REMOVED);
    }
}

// The corners of a triangle after the moves.
fn moved(t: u32) -> vec3<u32> {
    var corners = mesh[t].xyz;
    for (var k = 0u; k < 3u; k += 1u) {
        if is_moving(corners[k]) {
            corners[k] = target_of(corners[k]);
        }
    }
    return corners;
}

// Whether each triangle is left, for the sums of these to be the next numbers.
@compute @workgroup_size(SIZE)
fn find_left(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = number_of(id, groups);
    if t >= params.triangles {
        return;
    }
    let c = moved(t);
    next_rings[place(t)] = u32(c.x != c.y && c.y != c.z && c.z != c.x);
}

// The triangles that are left, in order, and how many each vertex has.
@compute @workgroup_size(SIZE)
fn gather(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = number_of(id, groups);
    if t >= params.triangles {
        return;
    }
    let number = atomicLoad(&next_rings_atomic[place(t)]);
    var before = 0u;
    if t > 0u {
        before = atomicLoad(&next_rings_atomic[place(t - 1u)]);
    }
    if number != before {
        let corners = moved(t);
        next_mesh[before] = vec4<u32>(corners, t);
        for (var k = 0u; k < 3u; k += 1u) {
            atomicAdd(&next_rings_atomic[corners[k]], 1u);
        }
    }
    if t == params.triangles - 1u {
        atomicStore(&marks[params.vertices + TRIANGLES], number);
    }
}

// From where its ring ends each vertex sinks to where it begins.
@compute @workgroup_size(SIZE)
fn fill_rings(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let t = number_of(id, groups);
    if t >= atomicLoad(&marks[params.vertices + TRIANGLES]) {
        return;
    }
    for (var k = 0u; k < 3u; k += 1u) {
        let own = atomicSub(&next_rings_atomic[next_mesh[t][k]], 1u) - 1u;
        atomicStore(&next_rings_atomic[place(own)], t);
    }
}

fn next_wing(k: u32, v: u32) -> vec2<u32> {
    return wing_of(next_mesh[next_rings[place(k)]], v);
}

const OPEN = 1u;
const SHUT = 2u;

// Whether the triangles round a vertex of the next mesh are one sheet, open or shut; 0: none of both.
fn shape_of(v: u32) -> u32 {
    let begin = next_rings[v];
    let end = next_rings[v + 1u];
    let size = end - begin;
    if size == 0u || size > MAX_TRIANGLES {
        return 0u;
    }
    // With edges that begin in one triangle each at most, each triangle is followed by one at most.
    var first = NOWHERE;
    for (var k = begin; k < end; k += 1u) {
        let start = next_wing(k, v).x;
        var ends_there = false;
        for (var j = begin; j < end; j += 1u) {
            let other = next_wing(j, v);
            if j < k && other.x == start {
                return 0u;
            }
            ends_there |= other.y == start;
        }
        if !ends_there {
            if first != NOWHERE {
                return 0u;
            }
            first = k;
        }
    }
    let start = select(first, begin, first == NOWHERE);
    var here = start;
    var seen = 1u;
    for (var turn = 0u; turn < MAX_TRIANGLES; turn += 1u) {
        let goal = next_wing(here, v).y;
        var next = NOWHERE;
        for (var k = begin; k < end && next == NOWHERE; k += 1u) {
            if next_wing(k, v).x == goal {
                next = k;
            }
        }
        if next == NOWHERE || next == start {
            break;
        }
        if seen == size {
            return 0u;
        }
        here = next;
        seen += 1u;
    }
    if seen < size {
        return 0u;
    }
    if first != NOWHERE {
        return OPEN;
    }
    return select(0u, SHUT, size > 2u);
}

fn call_off(v: u32) {
    if atomicExchange(&marks[v], 1u) == 0u {
        atomicStore(&marks[params.vertices + DISPUTED], 1u);
    }
}

// Calls off the dearest of the moves after which the triangles round a vertex would be no sheet any more, or open where they were shut,
// or the other way round; or each of them.
@compute @workgroup_size(SIZE)
fn check(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices || has_flag(v, LOCKED) || is_moving(v) {
        return;
    }
    var is_beside = false;
    for (var k = rings[v]; k < rings[v + 1u] && !is_beside; k += 1u) {
        let w = wing(k, v);
        is_beside = is_moving(w.x) || is_moving(w.y);
    }
    // What nobody round it moves does not change.
    if !is_beside || shape_of(v) == select(SHUT, OPEN, has_flag(v, BOUNDARY)) {
        return;
    }
    var dearest = NOWHERE;
    for (var k = rings[v]; k < rings[v + 1u]; k += 1u) {
        dearest = dearer(dearest, mesh[rings[place(k)]].xyz);
    }
    for (var k = next_rings[v]; k < next_rings[v + 1u]; k += 1u) {
        dearest = dearer(dearest, mesh[next_mesh[next_rings[place(k)]].w].xyz);
    }
    if dearest != NOWHERE && params.patience != PATIENCE_ALL {
        call_off(dearest);
    }
}

// The dearest of the movers so far and these; where all lose, they lose at once.
fn dearer(so_far: u32, corners: vec3<u32>) -> u32 {
    var dearest = so_far;
    for (var k = 0u; k < 3u; k += 1u) {
        let w = corners[k];
        if is_moving(w) {
            if params.patience == PATIENCE_ALL {
                call_off(w);
            } else if dearest == NOWHERE || is_before(rank_of(dearest), rank_of(w)) {
                dearest = w;
            }
        }
    }
    return dearest;
}
