//! The stellar operations on a corner table and their exact inverses (spec §5.1).
//!
//! (Velho 2001, Vieira et al. 2003, with the corrections of the specification: a table is left consistent, boundaries are
//! guarded, the corner of every vertex is renewed.) Each inverse restores V and O slot by slot. These functions do what they are
//! told; whether a new edge may exist is asked by their callers ([`super::operation`], the codec), who know what is at stake.

use crate::mesh::{Corner, CornerTable, Triangle, Vertex};

/// Edge flip. The edge opposite to `c` = (v; p, q) with far corner (r; q, p) becomes v–r.
///
/// Afterwards `c` is at v in (v, p, r), and the corner returned is at v in (v, r, q).
/// The edge must not be a boundary edge.
#[inline]
pub fn flip(table: &mut CornerTable, c: Corner) -> Corner {
    let o = table.opposite(c);
    let v = table.vertex(c);
    let ([r, q, p], [_, beyond_pr, _]) = (table.vertices_from(o), table.opposites_from(o));
    let beyond_qv = table.rewrite(c, r, beyond_pr, o.next());
    table.rewrite(o, v, beyond_qv, c.next());
    table.set_facing(beyond_pr, c);
    table.set_facing(beyond_qv, o);
    // v and r keep their corners; p is now in the triangle of c alone, q in that of o.
    table.replace_corner(p, o.prev(), c.next());
    table.replace_corner(q, c.prev(), o.next());
    o.prev()
}

/// Undoes [`flip`]: `c` is at v in (v, p, r), behind its edge r–v lies (v, r, q); v–r becomes p–q.
#[inline]
pub fn unflip(table: &mut CornerTable, c: Corner) {
    let m = table.opposite(c.next());
    let o = m.prev();
    let (p, q) = (table.vertex(c.next()), table.vertex(m));
    let (beyond_pr, beyond_qv) = (table.opposite(c), table.opposite(o));
    table.set_vertex(c.prev(), q);
    table.set_vertex(o.prev(), p);
    table.join(o.next(), beyond_pr);
    table.join(c.next(), beyond_qv);
    table.join(c, o);
    table.renew_corners(c.triangle());
    table.renew_corners(o.triangle());
}

/// Edge split: `v` appears on the edge opposite to `k` = (c; a, b), interior or boundary.
///
/// (c, a, b) becomes (c, a, v) and (c, v, b); beyond an interior edge (d, b, a) becomes (d, b, v) and (d, v, a).
/// Returns the corners at v that face the link edges b→c, c→a, and, in the interior, a→d, d→b.
#[inline]
pub fn split_edge(table: &mut CornerTable, k: Corner, v: Vertex) -> ([Corner; 4], usize) {
    let o = table.opposite(k);
    let left = Triangle(table.slots() as u32);
    let right = Triangle(left.0 + 1);
    table.set_corner(v, left.corner(1));
    if o.is_none() {
        split_side(table, k, v, left, [Corner::NONE; 2]);
        // At a boundary the outgoing edge of v leads to b: the new triangle.
        return ([left.corner(1), k.prev(), Corner::NONE, Corner::NONE], 2);
    }
    split_side(table, k, v, left, [right.corner(0), o]);
    split_side(table, o, v, right, [left.corner(0), k]);
    ([left.corner(1), k.prev(), right.corner(1), o.prev()], 4)
}

/// Splits the triangle (c; a, b) at `k` into (c, a, v) and the `new` (c, v, b). Told which corners will face a–v and v–b.
#[inline]
fn split_side(table: &mut CornerTable, k: Corner, v: Vertex, new: Triangle, facing: [Corner; 2]) {
    let [c, _, b] = table.vertices_from(k);
    let beyond = table.rewrite(k, v, facing[0], new.corner(2));
    table.push_triangle([c, v, b], [facing[1], beyond, k.next()]);
    table.set_facing(beyond, new.corner(1));
    // a and c keep their corners; b is now in the new triangle.
    table.replace_corner(b, k.prev(), new.corner(2));
}

/// Edge weld, the inverse of [`split_edge`]: `k` is at c in (c, a, v); v has four triangles in the interior, two at the boundary.
#[inline]
pub fn weld_edge(table: &mut CornerTable, k: Corner) {
    let v = table.vertex(k.prev());
    let right = table.opposite(k);
    let far = table.opposite(k.next()).next();
    // `far` is c's corner in (c, v, b), `o` is d's in (d, b, v), `right` is d's in (d, v, a).
    let o = table.opposite(far);
    let b = table.vertex(far.prev());
    let beyond_left = table.opposite(far.next());
    table.set_vertex(k.prev(), b);
    table.join(k.next(), beyond_left);
    table.open(k);
    if o.is_some() {
        let a = table.vertex(k.next());
        let beyond_right = table.opposite(right.next());
        table.set_vertex(o.prev(), a);
        table.join(o.next(), beyond_right);
        table.join(k, o);
        table.remove_triangle(right.triangle());
    }
    table.remove_triangle(far.triangle());
    table.corners[v.index()] = Corner::NONE;
    table.renew_corners(k.triangle());
    if o.is_some() {
        table.renew_corners(o.triangle());
    }
}

/// Face split: `v` appears in the triangle of `x` = (x, y, z), which becomes (x, y, v), (y, z, v), (z, x, v).
#[inline]
pub fn split_face(table: &mut CornerTable, x: Corner, v: Vertex) {
    table.reserve_vertex(v);
    let [vx, vy, vz] = [x, x.next(), x.prev()].map(|c| table.vertex(c));
    let (beyond_yz, beyond_zx) = (table.opposite(x), table.opposite(x.next()));
    let second = table.push_triangle([vy, vz, v], [Corner::NONE; 3]);
    let third = table.push_triangle([vz, vx, v], [Corner::NONE; 3]);
    table.set_vertex(x.prev(), v);
    table.join(second.corner(2), beyond_yz);
    table.join(third.corner(2), beyond_zx);
    table.join(second.corner(1), x);
    table.join(second.corner(0), third.corner(1));
    table.join(third.corner(0), x.next());
    for t in [x.triangle(), second, third] {
        table.renew_corners(t);
    }
}

/// Face weld, the inverse of [`split_face`]: `x` is at x in (x, y, v), and v has three triangles.
#[inline]
pub fn weld_face(table: &mut CornerTable, x: Corner) {
    let v = table.vertex(x.prev());
    let second = table.opposite(x).prev();
    let third = table.opposite(x.next());
    // `second` is y's corner in (y, z, v), `third` is z's in (z, x, v).
    let z = table.vertex(third);
    let (beyond_yz, beyond_zx) = (table.opposite(second.prev()), table.opposite(third.prev()));
    table.set_vertex(x.prev(), z);
    table.join(x, beyond_yz);
    table.join(x.next(), beyond_zx);
    table.remove_triangle(third.triangle());
    table.remove_triangle(second.triangle());
    table.corners[v.index()] = Corner::NONE;
    table.renew_corners(x.triangle());
}

/// Attach: the triangle (b, a, v) grows on the boundary edge a→b opposite to `k`.
#[inline]
pub fn attach(table: &mut CornerTable, k: Corner, v: Vertex) {
    table.reserve_vertex(v);
    let (a, b) = table.edge(k);
    let ear = table.push_triangle([b, a, v], [Corner::NONE; 3]);
    table.join(ear.corner(2), k);
    table.renew_corners(ear);
}

/// Ear removal, the inverse of [`attach`]: the only triangle at `v` goes; its inner edge must not be a boundary edge.
#[inline]
pub fn detach(table: &mut CornerTable, v: Vertex) {
    let ear = table.corner_of(v);
    let k = table.opposite(ear);
    table.open(k);
    table.remove_triangle(ear.triangle());
    table.corners[v.index()] = Corner::NONE;
    table.renew_corners(k.triangle());
}
