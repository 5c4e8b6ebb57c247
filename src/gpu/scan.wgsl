// Each number becomes the sum of itself and all before it: sums of blocks, sums of these, and again within the blocks.

const THREADS = 256u;
const EACH = 4u;
var<workgroup> part: array<u32, THREADS>;

// Each of the workgroup's numbers becomes the sum of itself and those before it.
fn add_up(thread: u32, own: u32) -> u32 {
    part[thread] = own;
    for (var step = 1u; step < THREADS; step <<= 1u) {
        workgroupBarrier();
        var before = 0u;
        if thread >= step {
            before = part[thread - step];
        }
        workgroupBarrier();
        part[thread] += before;
    }
    workgroupBarrier();
    return part[thread];
}

// The numbers from `first` to `end` that are this thread's.
fn own_sum(first: u32, end: u32) -> u32 {
    var sum = 0u;
    for (var k = first; k < min(first + EACH, end); k += 1u) {
        sum += next_rings[k];
    }
    return sum;
}

fn add_block(group: u32, thread: u32, offset: u32, length: u32) {
    let first = offset + (group * THREADS + thread) * EACH;
    let sum = add_up(thread, own_sum(first, offset + length));
    if thread == THREADS - 1u && group * THREADS * EACH < length {
        sums[group] = sum;
    }
}

fn add_sums(thread: u32, length: u32) {
    let blocks = (length + THREADS * EACH - 1u) / (THREADS * EACH);
    var before = 0u;
    for (var base = 0u; base < blocks; base += THREADS) {
        let k = base + thread;
        var own = 0u;
        if k < blocks {
            own = sums[k];
        }
        let sum = add_up(thread, own);
        if k < blocks {
            // Of the blocks before it.
            sums[k] = before + sum - own;
        }
        before += part[THREADS - 1u];
        workgroupBarrier();
    }
}

fn spread_block(group: u32, thread: u32, offset: u32, length: u32) {
    let first = offset + (group * THREADS + thread) * EACH;
    let end = offset + length;
    let own = own_sum(first, end);
    let within = add_up(thread, own);
    if first < end {
        var sum = sums[group] + within - own;
        for (var k = first; k < min(first + EACH, end); k += 1u) {
            sum += next_rings[k];
            next_rings[k] = sum;
        }
    }
}

fn group_of(id: vec3<u32>, groups: vec3<u32>) -> u32 {
    return id.x + id.y * groups.x;
}

// Of what is left of the triangles.
@compute @workgroup_size(THREADS)
fn add_left(@builtin(workgroup_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    add_block(group_of(id, groups), thread, place(0u), params.triangles);
}

@compute @workgroup_size(THREADS)
fn add_left_sums(@builtin(local_invocation_index) thread: u32) {
    add_sums(thread, params.triangles);
}

@compute @workgroup_size(THREADS)
fn spread_left(@builtin(workgroup_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    spread_block(group_of(id, groups), thread, place(0u), params.triangles);
}

// Of the triangles of each vertex.
@compute @workgroup_size(THREADS)
fn add_rings(@builtin(workgroup_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    add_block(group_of(id, groups), thread, 0u, params.vertices + 1u);
}

@compute @workgroup_size(THREADS)
fn add_ring_sums(@builtin(local_invocation_index) thread: u32) {
    add_sums(thread, params.vertices + 1u);
}

@compute @workgroup_size(THREADS)
fn spread_rings(@builtin(workgroup_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    spread_block(group_of(id, groups), thread, 0u, params.vertices + 1u);
}
