//! What the attributes of the input mean to the simplification: where charts meet, and what values at corners are worth.

use super::attributes::named;
use super::{AttributeBirth, Options};
use crate::container::AttributeEntry;
pub(super) use crate::mesh::attributes::worth::is_chart;
use crate::mesh::attributes::worth::worth;
use crate::mesh::attributes::{Attribute, Domain, NO_VALUE, Semantic};
use crate::mesh::topology::{Manifold, Remainder};
use crate::mesh::{Corner, CornerTable, IndexedMesh, Lattice, Triangle, Vertex};
use crate::simplify::{Bodies, Features, Values};
use std::collections::HashMap;

/// The features of a conditioned mesh. `entries` tell how its attributes are quantised: what that makes equal is no seam.
///
/// Charts are those of texture coordinates and parts. An attribute that is born at the finest level has no say, and neither has one whose
/// values are not all finite, which is.
pub fn features(
    mesh: &IndexedMesh,
    manifold: &Manifold,
    remainder: &Remainder,
    entries: &[AttributeEntry],
    options: &Options,
    lattice: &Lattice,
) -> Features {
    let input = Input { table: &manifold.table, triangles: triangles(remainder), remainder };
    let size = lattice.step * f64::from(lattice.max_coordinate());
    let mut features = Features::default();
    let mut columns = Vec::new();
    let has_normals = mesh.attributes.iter().any(|a| a.semantic == Semantic::Normal);
    let said = mesh.attributes.iter().zip(entries).map(|(a, entry)| (a, entry, birth(a, options)));
    for (attribute, entry, birth) in said.filter(|(a, _, birth)| may_be_coarse(a, *birth)) {
        let classes = classes(attribute, entry);
        let is_chart = is_chart(attribute);
        let meets = is_chart && input.is_parted(attribute, &classes);
        let is_part = attribute.semantic == Semantic::Part;
        // What part a triangle is of must be known where it is asked for; texture coordinates are kept with all charts.
        let is_kept = meets && is_part && birth == AttributeBirth::Base;
        features.binding |= meets && !is_part && birth == AttributeBirth::Base;
        let of_facets = if has_normals || attribute.semantic != Semantic::TexCoord { 1.0 } else { OF_FACETS };
        let worth = input.worth(attribute, &manifold.positions, size);
        let scale = weight(attribute, options) * of_facets * worth;
        let has_price = attribute.domain == Domain::Corner && scale > 0.0 && scale.is_finite();
        if has_price || meets {
            let scale = has_price.then_some(scale);
            columns.push(Column { attribute, classes, scale, is_chart, meets, is_kept });
        }
    }
    // Those of charts come first, of them those that are kept.
    columns.sort_by_key(|column| (!column.is_kept, !column.is_chart));
    features.values = input.values(&columns);
    features.binding |= !features.values.charts.is_empty() && !input.have_others(&features.values);
    features
}

/// What texture coordinates weigh where there are no normals. Then facets are what is lit, and how far they turn has no price of its own:
/// where vertices lie counts for more beside how far a texture slips.
const OF_FACETS: f64 = 0.375;

/// Which vertices of a conditioned mesh are of which body.
pub fn bodies(mesh: &IndexedMesh, remainder: &Remainder) -> Bodies {
    let body = |v: &Vertex| mesh.bodies.partition_point(|&first| first <= v.0) as u32;
    Bodies::new(remainder.origins.vertices.iter().map(body).collect())
}

/// Whether an attribute may be born at a coarser level than the finest.
pub fn may_be_coarse(attribute: &Attribute, birth: AttributeBirth) -> bool {
    let count = attribute.values.len();
    birth != AttributeBirth::Finest && (0..count).all(|at| attribute.values.number(at).is_finite())
}

/// Where an attribute is wanted to be born.
pub fn birth(attribute: &Attribute, options: &Options) -> AttributeBirth {
    named(attribute, &options.attribute_births).unwrap_or_default()
}

fn weight(attribute: &Attribute, options: &Options) -> f64 {
    named(attribute, &options.attribute_weights).unwrap_or(1.0)
}

/// For each value of an attribute which quantised value it is.
fn classes(attribute: &Attribute, entry: &AttributeEntry) -> Vec<u32> {
    let mut places = HashMap::new();
    let class = |value: usize| {
        let mut integers = Vec::with_capacity(attribute.components);
        entry.quantisation.quantise(attribute, value, &mut integers);
        let next = places.len() as u32;
        *places.entry(integers).or_insert(next)
    };
    (0..attribute.count()).map(class).collect()
}

/// The triangles of the table, by their places in the input.
fn triangles(remainder: &Remainder) -> Vec<u32> {
    remainder.origins.in_table.iter_ones().map(|t| t as u32).collect()
}

/// An attribute that has a price, or charts.
struct Column<'a> {
    attribute: &'a Attribute,
    classes: Vec<u32>,
    /// A difference of 1 is worth so many sides of the lattice's cube, if anything.
    scale: Option<f64>,
    is_chart: bool,
    /// Whether its charts meet.
    meets: bool,
    /// Whether its charts are kept at all levels.
    is_kept: bool,
}

struct Input<'a> {
    table: &'a CornerTable,
    triangles: Vec<u32>,
    remainder: &'a Remainder,
}

impl Input<'_> {
    /// The value of a corner of the table.
    fn value(&self, attribute: &Attribute, c: Corner) -> Option<usize> {
        let t = c.triangle().index();
        let place = match c.place() {
            0 => 0,
            // Turned round, a triangle has its first corner in its place.
            place if self.remainder.flipped[t] => 3 - place,
            place => place,
        };
        attribute.at(self.triangles[t] as usize, place)
    }

    /// The corners at both ends of the edge opposite to one, those on one side first, of each edge between two triangles.
    fn edges(&self) -> impl Iterator<Item = [[Corner; 2]; 2]> + '_ {
        let corners = self.table.triangles().flat_map(|t| t.corners()).map(|c| (c, self.table.opposite(c)));
        let once = corners.filter(|&(c, o)| o.is_some() && c < o);
        once.map(|(c, o)| [[c.next(), c.prev()], [o.prev(), o.next()]])
    }

    /// Whether values are not the same on both sides of some edge.
    fn is_parted(&self, attribute: &Attribute, classes: &[u32]) -> bool {
        let class = |c: Corner| self.value(attribute, c).map_or(NO_VALUE, |value| classes[value]);
        self.edges().any(|[a, b]| a.map(class) != b.map(class))
    }

    /// Whether there are charts that meet where those that are kept do not.
    fn have_others(&self, values: &Values) -> bool {
        let of = |c: Corner| values.charts[values.corners[c.triangle().index()][c.place()] as usize];
        let differ = |[a, b]: [[Corner; 2]; 2], k: usize| a.map(|c| of(c)[k]) != b.map(|c| of(c)[k]);
        self.edges().any(|edge| differ(edge, 0) && !differ(edge, 1))
    }

    /// How many sides of the lattice's cube, `size`, a difference of 1 is worth where the weight is 1.
    fn worth(&self, attribute: &Attribute, positions: &[[f64; 3]], size: f64) -> f64 {
        let of = |t: Triangle| {
            let values = t.corners().map(|c| self.value(attribute, c));
            (values, self.table.triangle(t).map(|v| positions[v.index()]))
        };
        worth(attribute, size, self.table.triangles().map(of))
    }

    /// The rows of the corners.
    fn values(&self, columns: &[Column]) -> Values {
        let mut values = Values::default();
        if columns.is_empty() {
            return values;
        }
        values.corners = vec![[0; 4]; self.table.slots()];
        let mut first_of_row = vec![Corner::NONE];
        // By row what it is in charts, and in those that are kept.
        let mut charts = vec![[0; 2]];
        for &Column { attribute, ref classes, scale, is_chart, is_kept, .. } in columns {
            if scale.is_some() {
                if attribute.semantic == Semantic::Normal {
                    values.normals.push(values.width);
                }
                values.width += attribute.components;
                if is_chart {
                    values.of_charts = values.width;
                }
            }
            // Rows so far, parted further by this attribute.
            let (mut rows, mut kinds) = (HashMap::new(), HashMap::new());
            first_of_row.clear();
            let mut of_rows = Vec::new();
            for c in self.table.triangles().flat_map(|t| t.corners()) {
                let class = self.value(attribute, c).map_or(NO_VALUE, |value| classes[value]);
                let own = &mut values.corners[c.triangle().index()];
                if attribute.domain == Domain::Triangle && c.place() == 0 {
                    let next = kinds.len() as u32;
                    own[3] = *kinds.entry((own[3], class)).or_insert(next);
                }
                let row = &mut own[c.place()];
                let [chart, kept] = charts[*row as usize];
                let next = first_of_row.len() as u32;
                *row = *rows.entry((*row, class)).or_insert(next);
                if *row == next {
                    first_of_row.push(c);
                    of_rows.push([if is_chart { next } else { chart }, if is_kept { next } else { kept }]);
                }
            }
            charts = of_rows;
        }
        if columns.iter().any(|column| column.meets) {
            values.charts = charts;
        }
        values.rows.reserve(first_of_row.len() * values.width);
        for c in first_of_row {
            for column in columns {
                self.push(column, c, &mut values.rows);
            }
        }
        values
    }

    /// Appends the numbers of a corner.
    fn push(&self, &Column { attribute, scale, .. }: &Column, c: Corner, out: &mut Vec<f32>) {
        let (n, Some(scale)) = (attribute.components, scale) else { return };
        let Some(value) = self.value(attribute, c) else {
            out.extend(std::iter::repeat_n(f32::NAN, n));
            return;
        };
        let numbers = (value * n..(value + 1) * n).map(|at| attribute.values.number(at));
        let mut scale = scale;
        if attribute.semantic == Semantic::Normal {
            let length = numbers.clone().map(|x| x * x).sum::<f64>().sqrt();
            scale = if length > 0.0 { scale / length } else { 0.0 };
        }
        out.extend(numbers.map(|x| (x * scale) as f32));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::attributes::Values as Numbers;
    use crate::mesh::topology::Weld;
    use crate::mesh::topology::{Conditioned, condition};
    use crate::mesh::{Attribute, Vertex, shapes};

    fn of(mesh: &IndexedMesh, options: &Options) -> (CornerTable, Features) {
        let Conditioned { manifold, remainder, .. } = condition(mesh, Weld::Exact);
        let entries = super::super::attributes::entries(mesh, options);
        let bits = 10;
        let whole = Lattice { origin: [0.0; 3], step: 1.0, bits };
        let lattice = Lattice { step: 1.0 / f64::from(whole.max_coordinate()), ..whole };
        let features = features(mesh, &manifold, &remainder, &entries, options, &lattice);
        (manifold.table, features)
    }

    /// A flat sheet of 4 by 3 squares.
    fn flat() -> IndexedMesh {
        let mut mesh = shapes::grid(4, 3);
        for (k, p) in (0..).zip(&mut mesh.positions) {
            *p = [f64::from(k % 5), f64::from(k / 5), 0.0];
        }
        mesh
    }

    /// The sheet, some triangles of it turned round; texture coordinates are the places but for a column to the right of
    /// which they start anew.
    fn sheet(column: u32) -> IndexedMesh {
        let mut mesh = flat();
        for t in mesh.triangles.iter_mut().step_by(3) {
            t.swap(0, 2);
        }
        let (mut numbers, mut corners) = (Vec::new(), Vec::new());
        for t in &mesh.triangles {
            let middle = t.iter().map(|&v| mesh.positions[v as usize][0]).sum::<f64>() / 3.0;
            for &v in t {
                let [x, y, _] = mesh.positions[v as usize];
                corners.push(numbers.len() as u32 / 2);
                numbers.extend([if middle > f64::from(column) { x + 10.0 } else { x }, y].map(|x| x as f32));
            }
        }
        mesh.attributes.push(Attribute::new(Semantic::TexCoord, 2, Numbers::F32(numbers), corners));
        mesh
    }

    fn seams(table: &CornerTable, features: &Features) -> Vec<[u32; 2]> {
        let Values { corners: rows, charts, .. } = &features.values;
        let of =
            |c: Corner| charts.get(rows[c.triangle().index()][c.place()] as usize).map(|charts| charts[0]);
        let is_seam = |&c: &Corner| {
            let o = table.opposite(c);
            o.is_some() && (of(c.next()) != of(o.prev()) || of(c.prev()) != of(o.next()))
        };
        let corners = table.triangles().flat_map(|t| t.corners());
        let mut seams: Vec<_> = corners
            .filter(is_seam)
            .map(|c| table.edge(c))
            .map(|(a, b)| [a.0.min(b.0), a.0.max(b.0)])
            .collect();
        seams.sort_unstable();
        seams
    }

    /// Of the places of the table's vertices, the edges along a column of the sheet, from both sides.
    fn along(mesh: &IndexedMesh, column: u32) -> Vec<[u32; 2]> {
        let Conditioned { manifold, .. } = condition(mesh, Weld::Exact);
        let on = |v: Vertex| manifold.positions[v.index()][0] == f64::from(column);
        let corners = manifold.table.triangles().flat_map(|t| t.corners());
        let mut edges: Vec<_> = corners
            .map(|c| manifold.table.edge(c))
            .filter(|&(a, b)| on(a) && on(b))
            .map(|(a, b)| [a.0.min(b.0), a.0.max(b.0)])
            .collect();
        edges.sort_unstable();
        edges
    }

    #[test]
    fn a_seam_is_where_texture_coordinates_differ() {
        let mesh = sheet(2);
        let (table, features) = of(&mesh, &Options::default());
        let found = seams(&table, &features);
        assert_eq!(found.len(), 6, "three edges, from both sides");
        assert_eq!(found, along(&mesh, 2));
        assert!(!features.binding);
        // Open borders are none.
        let (_, features) = of(&sheet(4), &Options::default());
        assert!(features.values.charts.is_empty());
    }

    #[test]
    fn births_say_which_charts_are_kept() {
        let mesh = sheet(2);
        let said = |birth| Options { attribute_births: vec![("uv".into(), birth)], ..Options::default() };
        let (_, finest) = of(&mesh, &said(AttributeBirth::Finest));
        assert_eq!(finest, Features::default());
        assert!(of(&mesh, &said(AttributeBirth::Base)).1.binding);
        assert!(of(&sheet(4), &said(AttributeBirth::Base)).1.values.charts.is_empty(), "there are none");
        // What is not finite comes with level 0.
        let mut broken = mesh;
        let Numbers::F32(numbers) = &mut broken.attributes[0].values else { panic!("they are") };
        numbers[7] = f32::NAN;
        assert_eq!(of(&broken, &Options::default()).1, Features::default());
    }

    #[test]
    fn no_value_is_a_value_and_parts_are_charts() {
        let mut mesh = sheet(4);
        let corners = &mut mesh.attributes[0].corners;
        // Two triangles that share a diagonal.
        corners[..6].fill(NO_VALUE);
        let (table, features) = of(&mesh, &Options::default());
        let inner = seams(&table, &features);
        assert_eq!(inner.len(), 4, "a square in the corner of the sheet has two inner edges: {inner:?}");
        let mut parts = flat();
        let side = |t: &[u32; 3]| t.iter().map(|&v| parts.positions[v as usize][0]).sum::<f64>() > 6.0;
        let numbers: Vec<_> = parts.triangles.iter().map(|t| u32::from(side(t))).collect();
        parts.attributes.push(Attribute::parts(&numbers));
        let (table, features) = of(&parts, &Options::default());
        assert_eq!(seams(&table, &features), along(&parts, 2));
        assert_eq!(features.values.width, 0, "a part has no price");
        // But a part's triangles never stand in for another's.
        let kinds: std::collections::HashSet<u32> = features.values.corners.iter().map(|of| of[3]).collect();
        assert_eq!(kinds.len(), 2);
    }

    /// The texture of the sheet is as large as the sheet: as far as it slips a texture coordinate changes. Weights make it more, and that there
    /// are no normals makes it less.
    #[test]
    fn a_slip_counts_as_far_as_it_is() {
        let mut mesh = sheet(4);
        let size = |mesh: &IndexedMesh, options: &Options| {
            let values = of(mesh, options).1.values;
            let width = values.width;
            assert_eq!((values.of_charts, values.rows.len()), (2, width * 20));
            let number = |k: usize| values.rows.iter().skip(k).step_by(width).copied();
            (number(0).fold(0.0, f32::max), number(1).fold(0.0, f32::max))
        };
        assert_eq!(size(&mesh, &Options::default()), (1.5, 1.125));
        let heavy = Options { attribute_weights: vec![("uv".into(), 2.0)], ..Options::default() };
        assert_eq!(size(&mesh, &heavy), (3.0, 2.25));
        let none = Options { attribute_weights: vec![("uv".into(), 0.0)], ..Options::default() };
        assert_eq!(of(&mesh, &none).1.values, Values::default());
        let up = Numbers::F32(vec![0.0, 0.0, 1.0]);
        mesh.attributes.push(Attribute::new(Semantic::Normal, 3, up, vec![0; 3 * mesh.triangles.len()]));
        assert_eq!(size(&mesh, &Options::default()), (4.0, 3.0));
    }
}
