// Where each candidate would go, as src/reduce/removal/propose.rs has it. Round a vertex that is not locked the triangles are a sheet of
// at most 255: each but the last neighbour of an open one is where a wing begins, and is in two triangles if a wing ends there, too.

// No way.
const CLOSED = 0xffffffffu;
// Pairs of ways of a triangle's two other corners that are looked at.
const MOST_WAYS = 256u;

// The neighbour where a wing begins, or, after the last one, that where none does; and its triangles at the edge. NOWHERE: there is none.
fn neighbour(v: u32, begin: u32, end: u32, k: u32) -> vec2<u32> {
    if !has_flag(v, BOUNDARY) {
        if k == end {
            return vec2<u32>(NOWHERE, 0u);
        }
        return vec2<u32>(wing(k, v).x, 2u);
    }
    if k < end {
        let start = wing(k, v).x;
        for (var j = begin; j < end; j += 1u) {
            if wing(j, v).y == start {
                return vec2<u32>(start, 2u);
            }
        }
        return vec2<u32>(start, 1u);
    }
    for (var j = begin; j < end; j += 1u) {
        let last = wing(j, v).y;
        var begins = false;
        for (var i = begin; i < end && !begins; i += 1u) {
            begins = wing(i, v).x == last;
        }
        if !begins {
            return vec2<u32>(last, 1u);
        }
    }
    return vec2<u32>(NOWHERE, 0u);
}

// Whether v may go to a neighbour, as far as it is for those two to say.
fn is_open(v: u32, n: vec2<u32>) -> bool {
    if n.x == NOWHERE {
        return false;
    }
    if is_candidate(n.x) || (params.rule == RULE_2015 && is_selected(n.x)) {
        return false;
    }
    return n.y == 1u || !has_flag(v, BOUNDARY);
}

// What it costs to go to a neighbour: how far that is off the triangles, times their areas.
fn price(v: u32, begin: u32, end: u32, by: u32, neighbour: u32) -> u32 {
    let origin = at(v);
    let to = shifted(at(neighbour) - origin, by);
    var sum = Wide(0u);
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        let n = cross_of(shifted(at(w.x) - origin, by), shifted(at(w.y) - origin, by));
        sum = plus(sum, wide_abs(dot_of(n, to)));
    }
    return key_of(sum, 3u * by);
}

// The link condition.
fn is_linked(v: u32, begin: u32, end: u32, to: u32) -> bool {
    for (var k = rings[to]; k < rings[to + 1u]; k += 1u) {
        let corners = wing(k, to);
        for (var side = 0u; side < 2u; side += 1u) {
            let w = corners[side];
            var is_common = false;
            var is_opposite = false;
            for (var j = begin; j < end; j += 1u) {
                let other = wing(j, v);
                is_common |= other.x == w || other.y == w;
                is_opposite |= (other.x == to && other.y == w) || (other.x == w && other.y == to);
            }
            if is_common && !is_opposite {
                return false;
            }
        }
    }
    return true;
}

// Whether no triangle turns over.
fn holds(v: u32, begin: u32, end: u32, to: u32) -> bool {
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        if w.x == to || w.y == to {
            continue;
        }
        if !keeps_side(normal_of(at(v), at(w.x), at(w.y)), normal_of(at(to), at(w.x), at(w.y))) {
            return false;
        }
    }
    return true;
}

// Where a vertex might be after the iteration: in its place, or at its neighbour k. NOWHERE: that cannot be.
fn way(x: u32, k: u32) -> u32 {
    if k == 0u {
        return x;
    }
    let n = neighbour(x, rings[x], rings[x + 1u], rings[x] + k - 1u);
    return select(NOWHERE, n.x, is_open(x, n));
}

// The bound of k for `way`.
fn most_ways(x: u32) -> u32 {
    return select(1u, rings[x + 1u] - rings[x] + 2u, is_candidate(x));
}

fn count_ways(x: u32) -> u32 {
    var ways = 0u;
    let most = most_ways(x);
    for (var k = 0u; k < most; k += 1u) {
        ways += u32(way(x, k) != NOWHERE);
    }
    return ways;
}

// Whether no triangle turns over, whatever the other candidates do.
fn holds_blindly(v: u32, begin: u32, end: u32, to: u32) -> bool {
    for (var k = begin; k < end; k += 1u) {
        let w = wing(k, v);
        if w.x == to || w.y == to {
            continue;
        }
        if count_ways(w.x) * count_ways(w.y) > MOST_WAYS {
            return false;
        }
        let old = normal_of(at(v), at(w.x), at(w.y));
        let first = most_ways(w.x);
        let second = most_ways(w.y);
        for (var i = 0u; i < first; i += 1u) {
            let a = way(w.x, i);
            if a == NOWHERE || a == to {
                continue;
            }
            for (var j = 0u; j < second; j += 1u) {
                let b = way(w.y, j);
                if b == NOWHERE || b == to || b == a {
                    continue;
                }
                if !keeps_side(old, normal_of(at(to), at(a), at(b))) {
                    return false;
                }
            }
        }
    }
    return true;
}

@compute @workgroup_size(SIZE)
fn propose(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let v = number_of(id, groups);
    if v >= params.vertices {
        return;
    }
    var target_vertex = NOWHERE;
    var cost = 0u;
    if is_candidate(v) {
        let begin = rings[v];
        let end = rings[v + 1u];
        var largest = 0u;
        for (var k = begin; k < end; k += 1u) {
            let w = wing(k, v);
            largest |= magnitude(at(w.x) - at(v)) | magnitude(at(w.y) - at(v));
        }
        let by = shift_of(largest);
        // The prices stand in the vertex's own places; that of the last neighbour of an open sheet has none.
        var last = vec2<u32>(CLOSED, NOWHERE);
        for (var k = begin; k <= end; k += 1u) {
            let n = neighbour(v, begin, end, k);
            var own = CLOSED;
            if is_open(v, n) {
                own = price(v, begin, end, by, n.x);
            }
            if k < end {
                next_rings[place(k)] = own;
            } else {
                last = vec2<u32>(own, n.x);
            }
        }
        // The cheapest first, and of two as cheap that of the lower number, until one holds.
        var tried = vec2<u32>(0u);
        for (var turn = 0u; turn <= end - begin && target_vertex == NOWHERE; turn += 1u) {
            var best = vec2<u32>(CLOSED, NOWHERE);
            for (var k = begin; k <= end; k += 1u) {
                var other = last;
                if k < end {
                    other = vec2<u32>(next_rings[place(k)], wing(k, v).x);
                }
                if (turn == 0u || is_before(tried, other)) && is_before(other, best) {
                    best = other;
                }
            }
            if best.x == CLOSED {
                break;
            }
            tried = best;
            if is_linked(v, begin, end, best.y) {
                var fits = false;
                if params.guard == GUARD_BLIND {
                    fits = holds_blindly(v, begin, end, best.y);
                } else {
                    fits = holds(v, begin, end, best.y);
                }
                if fits {
                    target_vertex = best.y;
                    cost = best.x;
                }
            }
        }
    }
    state[4u * params.vertices + v] = target_vertex;
    state[5u * params.vertices + v] = cost;
    if target_vertex != NOWHERE {
        count(PROPOSED);
    }
}

// By price, then by number.
fn is_before(a: vec2<u32>, b: vec2<u32>) -> bool {
    return a.x < b.x || (a.x == b.x && a.y < b.y);
}
