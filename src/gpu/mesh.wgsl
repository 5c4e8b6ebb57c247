// What all steps look at. A vertex, a triangle or a place in a ring belongs to one invocation; marks may be set by whoever likes.

struct Params {
    vertices: u32,
    // Of the present mesh.
    triangles: u32,
    // Counted from 0.
    iteration: u32,
    patience: u32,
    rule: u32,
    guard: u32,
    // Whether there is a view; all that follows is of it.
    is_seen: u32,
    slope: u32,
    eye: vec4<i32>,
    // The cosine is the last of the four.
    forward: vec4<i32>,
}

@group(0) @binding(0) var<uniform> params: Params;
// On the lattice, with flags.
@group(0) @binding(1) var<storage, read> points: array<vec4<i32>>;
// The present mesh: corners, and which triangle of the mesh before each was.
@group(0) @binding(2) var<storage, read> mesh: array<vec4<u32>>;
// For each vertex where its ring begins, and for the last one where it ends; then the rings, in no order.
@group(0) @binding(3) var<storage, read> rings: array<u32>;
// For each vertex, one after the other: whether it is selected, near, a candidate, moving; its target and what that costs.
@group(0) @binding(4) var<storage, read_write> state: array<u32>;
// For each vertex whether its move is called off; then the counts.
@group(0) @binding(5) var<storage, read_write> marks: array<atomic<u32>>;
// The mesh that is made. Until it has rings their places are memory for whatever is wanted.
@group(0) @binding(6) var<storage, read_write> next_mesh: array<vec4<u32>>;
@group(0) @binding(7) var<storage, read_write> next_rings: array<u32>;
@group(0) @binding(7) var<storage, read_write> next_rings_atomic: array<atomic<u32>>;
@group(0) @binding(8) var<storage, read_write> sums: array<u32>;

const SIZE = 64u;
const NOWHERE = 0xffffffffu;
const MAX_TRIANGLES = 255u;

// Flags of a point: it stays whatever the view is, it is auxiliary, it is on the boundary, nothing round it moves.
const STAYS = 1;
const AUXILIARY = 2;
const BOUNDARY = 4;
const LOCKED = 8;

const RULE_2015 = 0u;
const GUARD_VETO = 0u;
const GUARD_BLIND = 1u;
const GUARD_INDEPENDENT = 2u;
const PATIENCE_ALL = 1u;
const PATIENCE_STILL = 2u;

// Counts, behind the marks of the vertices.
const CANDIDATES = 0u;
const PROPOSED = 1u;
const REMOVED = 2u;
const DISPUTED = 3u;
const TRIANGLES = 4u;

fn number_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x * SIZE;
}

fn count(what: u32) {
    atomicAdd(&marks[params.vertices + what], 1u);
}

fn at(v: u32) -> vec3<i32> {
    return points[v].xyz;
}

fn has_flag(v: u32, flag: i32) -> bool {
    return (points[v].w & flag) != 0;
}

fn is_selected(v: u32) -> bool {
    return state[v] != 0u;
}

fn is_near(v: u32) -> bool {
    return state[params.vertices + v] != 0u;
}

fn is_candidate(v: u32) -> bool {
    return state[2u * params.vertices + v] != 0u;
}

fn is_moving(v: u32) -> bool {
    return state[3u * params.vertices + v] != 0u;
}

fn target_of(v: u32) -> u32 {
    return state[4u * params.vertices + v];
}

fn cost_of(v: u32) -> u32 {
    return state[5u * params.vertices + v];
}

// A place in the rings.
fn place(k: u32) -> u32 {
    return params.vertices + 1u + k;
}

// The other two corners of a triangle of v, counter-clockwise.
fn wing_of(triangle: vec4<u32>, v: u32) -> vec2<u32> {
    if triangle.x == v {
        return triangle.yz;
    }
    if triangle.y == v {
        return triangle.zx;
    }
    return triangle.xy;
}

// That of a place in the ring of v.
fn wing(k: u32, v: u32) -> vec2<u32> {
    return wing_of(mesh[rings[place(k)]], v);
}
