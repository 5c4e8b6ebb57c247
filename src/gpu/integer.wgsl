// Arithmetic of the decisions, as src/reduce/removal/integer.rs has it. What has 64 bits there is a pair here, low half first.

alias Wide = vec2<u32>;

fn widened(x: i32) -> Wide {
    return Wide(bitcast<u32>(x), bitcast<u32>(x >> 31u));
}

fn plus(a: Wide, b: Wide) -> Wide {
    let low = a.x + b.x;
    return Wide(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn negated(a: Wide) -> Wide {
    return plus(~a, Wide(1u, 0u));
}

fn is_negative(a: Wide) -> bool {
    return (a.y >> 31u) != 0u;
}

fn is_above_zero(a: Wide) -> bool {
    return !is_negative(a) && (a.x | a.y) != 0u;
}

// Both without a sign.
fn is_less(a: Wide, b: Wide) -> bool {
    return a.y < b.y || (a.y == b.y && a.x < b.x);
}

fn wide_abs(a: Wide) -> Wide {
    return select(a, negated(a), is_negative(a));
}

fn shifted_up(a: Wide, by: u32) -> Wide {
    if by == 0u {
        return a;
    }
    if by >= 32u {
        return Wide(0u, a.x << (by - 32u));
    }
    return Wide(a.x << by, (a.y << by) | (a.x >> (32u - by)));
}

// With its sign, by less than 64.
fn shifted_down(a: Wide, by: u32) -> Wide {
    if by == 0u {
        return a;
    }
    let high = bitcast<i32>(a.y);
    if by >= 32u {
        return Wide(bitcast<u32>(high >> (by - 32u)), bitcast<u32>(high >> 31u));
    }
    return Wide((a.x >> by) | (a.y << (32u - by)), bitcast<u32>(high >> by));
}

fn leading_zeros(a: Wide) -> u32 {
    return select(countLeadingZeros(a.y), 32u + countLeadingZeros(a.x), a.y == 0u);
}

fn unsigned_product(a: u32, b: u32) -> Wide {
    let low = (a & 0xffffu) * (b & 0xffffu);
    let left = (a >> 16u) * (b & 0xffffu);
    let right = (a & 0xffffu) * (b >> 16u);
    let middle = (low >> 16u) + (left & 0xffffu) + (right & 0xffffu);
    let high = (a >> 16u) * (b >> 16u) + (left >> 16u) + (right >> 16u) + (middle >> 16u);
    return Wide((low & 0xffffu) | (middle << 16u), high);
}

fn product(a: i32, b: i32) -> Wide {
    let p = unsigned_product(bitcast<u32>(abs(a)), bitcast<u32>(abs(b)));
    return select(p, negated(p), (a ^ b) < 0);
}

fn dot_of(a: vec3<i32>, b: vec3<i32>) -> Wide {
    return plus(plus(product(a.x, b.x), product(a.y, b.y)), product(a.z, b.z));
}

fn cross_of(a: vec3<i32>, b: vec3<i32>) -> vec3<i32> {
    return a.yzx * b.zxy - a.zxy * b.yzx;
}

// A number of as many bits as the largest magnitude, or one more.
fn magnitude(d: vec3<i32>) -> u32 {
    let a = bitcast<vec3<u32>>(abs(d));
    return a.x | a.y | a.z;
}

// How far numbers of such a magnitude are shifted right so that they have 14 bits.
fn shift_of(magnitude: u32) -> u32 {
    return max(32u - countLeadingZeros(magnitude), 14u) - 14u;
}

fn shifted(d: vec3<i32>, by: u32) -> vec3<i32> {
    return d >> vec3<u32>(by);
}

fn normal_of(a: vec3<i32>, b: vec3<i32>, c: vec3<i32>) -> vec3<i32> {
    let u = b - a;
    let v = c - a;
    let by = shift_of(magnitude(u) | magnitude(v));
    return cross_of(shifted(u, by), shifted(v, by));
}

fn keeps_side(old: vec3<i32>, young: vec3<i32>) -> bool {
    return all(old == vec3<i32>(0)) || is_above_zero(dot_of(old, young));
}

// A number that grows with x * 2^by, of which it keeps 25 digits.
fn key_of(x: Wide, by: u32) -> u32 {
    if (x.x | x.y) == 0u {
        return 0u;
    }
    let zeros = leading_zeros(x);
    let digits = (shifted_up(x, zeros).y >> 6u) & 0x1ffffffu;
    return ((64u - zeros + by) << 25u) | digits;
}

// The largest integer whose square is at most x.
fn square_root(x: Wide) -> u32 {
    var root = 0u;
    for (var bit = 0x80000000u; bit != 0u; bit >>= 1u) {
        let next = root | bit;
        if !is_less(x, unsigned_product(next, next)) {
            root = next;
        }
    }
    return root;
}

// The quotient, or 2^32 - 1 where it is larger; the divisor is below 2^31.
fn quotient(x: Wide, divisor: u32) -> u32 {
    if x.y >= divisor {
        return 0xffffffffu;
    }
    var rest = x.y;
    var result = 0u;
    for (var bit = 32u; bit > 0u; bit -= 1u) {
        rest = (rest << 1u) | ((x.x >> (bit - 1u)) & 1u);
        result <<= 1u;
        if rest >= divisor {
            rest -= divisor;
            result |= 1u;
        }
    }
    return result;
}

// A number that looks random, another one for each vertex and iteration.
fn mixed(vertex: u32, iteration: u32) -> u32 {
    var x = vertex ^ (iteration * 0x9e3779b9u);
    x = (x ^ (x >> 16u)) * 0x85ebca6bu;
    x = (x ^ (x >> 13u)) * 0xc2b2ae35u;
    return x ^ (x >> 16u);
}
