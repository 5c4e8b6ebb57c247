//! Chapter 13.9: what is told of the attributes of an operation.

use super::attribute::Attribute;
use super::attributes::Attributes;
use super::column::Column;
use super::container::Result;
use super::decisions::known;
use super::entropy::{Code, Model};
use super::round::{self, Vertex};
use super::walk::{Edge, Mesh};
use super::whole_pass::fan;

/// The models of a segment.
pub struct Models {
    parts: [Model; 3],
    part: [[Model; 3]; 2],
    both: [Model; 2],
    second: [[Model; 3]; 2],
    beyond: Model,
    /// Of the values of seats.
    columns: Vec<Column>,
    round: round::Models,
}

/// An operation that has been carried out: what it has inserted, and at what.
#[derive(Clone, Copy)]
pub enum Site {
    Split(Edge),
    Face([usize; 3]),
    Attach(Edge),
}

/// A vertex of the link: its corners in the star, each with the one beyond, and whether it is an end of the edge split.
struct Seat(Vec<(Edge, Option<Edge>)>, usize);

impl Models {
    pub fn fresh(about: &[Attribute]) -> Self {
        Self {
            parts: [Model::FRESH; 3],
            part: [[Model::FRESH; 3], [known(64); 3]],
            both: [known(64); 2],
            second: [[Model::FRESH; 3]; 2],
            beyond: Model::FRESH,
            columns: about.iter().map(Column::fresh).collect(),
            round: round::Models::fresh(about),
        }
    }

    /// Of the operation that has inserted v.
    pub fn read(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        mesh: &Mesh,
        v: usize,
        site: Site,
    ) -> Result<()> {
        let told = attributes.of_corners();
        if told.is_empty() {
            return Ok(());
        }
        let (Site::Split((first, _)) | Site::Face([first, ..]) | Site::Attach((first, _))) = site;
        // The corners at v, by the edges that leave it.
        let mut at: Vec<Edge> = mesh.third.range((v, 0)..(v + 1, 0)).map(|(&(_, w), &y)| (w, y)).collect();
        let start = at.iter().position(|c| c.0 == first).unwrap_or(0);
        at.rotate_left(start);
        let corners = fan(mesh, &at);
        let parted = parted(attributes, mesh, &corners);
        self.link(code, attributes, mesh, &told, (parted, &seats(attributes, mesh, &corners, site)))?;
        let vertex = Vertex { mesh, corners, before: &[], told: &told };
        self.round.vertex(code, attributes, vertex, &|_| true)
    }

    fn link(
        &mut self,
        code: &mut Code,
        attributes: &mut Attributes,
        mesh: &Mesh,
        told: &[usize],
        (parted, seats): (usize, &[Seat]),
    ) -> Result<()> {
        let others = |seat: &Seat| seat.0.iter().filter(|(_, beyond)| beyond.is_some()).count();
        if !code.read(&mut self.parts[parted.min(2)])? {
            return Ok(());
        }
        for seat in seats {
            let e = seat.1;
            if !code.read(&mut self.part[e][others(seat)])? {
                continue;
            }
            let parting = match seat.0[..] {
                [x, y] if code.read(&mut self.both[e])? => vec![x, y],
                [x, y] => {
                    let k = match [x.1, y.1].map(|beyond| beyond.is_some()) {
                        [true, false] => 0,
                        [false, true] => 1,
                        _ => 2,
                    };
                    vec![if code.read(&mut self.second[e][k])? { y } else { x }]
                }
                _ => vec![seat.0[0]],
            };
            for (z, beyond) in parting {
                if let Some(beyond) = beyond
                    && code.read(&mut self.beyond)?
                {
                    attributes.of.insert(z, attributes.of[&beyond]);
                    continue;
                }
                let (wedge, carried) = (attributes.count, attributes.of[&z]);
                attributes.count += 1;
                for &k in told {
                    self.columns[k].wedge(code, attributes, mesh, (k, wedge), &[z], Some(carried))?;
                }
                attributes.of.insert(z, wedge);
            }
        }
        Ok(())
    }
}

/// How many spokes part the wedges at their far end.
fn parted(attributes: &Attributes, mesh: &Mesh, corners: &[Edge]) -> usize {
    let alive = attributes.of_corners();
    let wedge = |c: Edge| attributes.of[&c];
    let is_boundary = mesh.opposite(mesh.prev(corners[0])).is_none();
    (usize::from(is_boundary)..corners.len())
        .filter(|&i| {
            let before = corners[(i + corners.len() - 1) % corners.len()];
            !attributes.are_alike(wedge(mesh.prev(before)), wedge(mesh.next(corners[i])), &alive)
        })
        .count()
}

fn seats(attributes: &Attributes, mesh: &Mesh, corners: &[Edge], site: Site) -> Vec<Seat> {
    let alive = attributes.of_corners();
    let with = |c: Edge, beyond: Option<Edge>| {
        let differs = |beyond: &Edge| !attributes.are_alike(attributes.of[&c], attributes.of[beyond], &alive);
        (c, beyond.filter(differs))
    };
    let next = |c: Edge| with(mesh.next(c), mesh.opposite(c).map(|o| mesh.prev(o)));
    let prev = |c: Edge| with(mesh.prev(c), mesh.opposite(c).map(|o| mesh.next(o)));
    let ends = match site {
        Site::Split((a, b)) => vec![a, b],
        Site::Face(_) | Site::Attach(_) => vec![],
    };
    let k = corners.len();
    let is_boundary = mesh.opposite(mesh.prev(corners[0])).is_none();
    // Edges at v, the boundary's first and last: the corner before each, and the one behind.
    let before = |i: usize| (i > 0 || !is_boundary).then(|| prev(corners[(i + k - 1) % k]));
    let behind = |i: usize| (i < k).then(|| next(corners[i]));
    (0..k + usize::from(is_boundary))
        .map(|i| {
            let corners: Vec<_> = before(i).into_iter().chain(behind(i)).collect();
            let e = usize::from(ends.contains(&mesh.tip(corners[0].0)));
            Seat(corners, e)
        })
        .collect()
}
