//! The examples of §5.7, question by question and number by number. A decimal stands for the one binary32 number it is
//! nearest to, as in the text.

use unweld::codec::correction::{Copied, Correction};
use unweld::codec::grid::{Grid, Real};
use unweld::codec::order::Order;
use unweld::codec::residue::Residue;
use unweld::codec::walk::Tour;
use unweld::codec::whole::Whole;
use unweld::decoder::{self, decode};
use unweld::limits::Budget;

use super::agree::agree;
use super::by_hand;
use super::container::{Atom, BASE, CORRECTION, Level, ORDER, PRECISION, REFINEMENT};
use super::coordinates::Coordinate;
use super::draft::atom;
use super::hostile::base_alone;
use super::keyframe;
use super::lifting::Scale;
use super::refinement::{Models, trace_pass};
use super::trace::{Placed, Step};
use super::walk::{Edge, Mesh};

type Point = [i64; 3];

/// What a level pass on 8 bits does.
struct Pass {
    mesh: Mesh,
    steps: Vec<Step>,
}

impl Pass {
    fn of(payload: &[u8], [vertices, triangles]: [u64; 2], atom: Atom) -> Self {
        let level = Level { vertices, triangles, shift: 0, max_error: 0.0, rms_error: 0.0 };
        let mut mesh =
            keyframe::read(payload, level, Scale { shift: level.shift, ..Scale::plain(8) }).unwrap();
        let models = &mut Models::fresh(false);
        let (steps, result) = trace_pass(&mut mesh, vec![&atom], Scale::plain(8), models, None);
        result.unwrap();
        Self { mesh, steps }
    }

    /// The decisions, with their models and the numbers these were chosen by; vertices by the letters of their points.
    fn questions(&self, points: &[(char, Point)]) -> Vec<String> {
        let letter = |v: usize| {
            let (letter, _) = points.iter().find(|(_, point)| *point == self.mesh.points[v]).unwrap();
            *letter
        };
        let arrow = |(a, b): Edge| format!("{}→{}", letter(a), letter(b));
        let question = |step: &Step| match *step {
            Step::Split(k, c, yes) => {
                let models = format!("[{}][{}][{}, {}]", c.kind, c.closed, c.class, c.length);
                Some(format!("split {}? {models} {} {}", arrow(k), u8::from(yes), c.looked.size))
            }
            Step::Flip(edge, r, c, yes) => {
                let [p, q, at_r] = c.valences;
                let excess = p + q - at_r - c.flips as i64 - 2;
                let models = format!("[{excess}][{}][{}][{}]", c.end, c.flips, c.angle / 4);
                let beyond = format!("flip {}, r = {}?", arrow(edge), letter(r));
                Some(format!("{beyond} {models} {} {}", u8::from(yes), c.sum))
            }
            Step::Face(t, yes) => {
                Some(format!("face {}? {}", t.map(letter).iter().collect::<String>(), u8::from(yes)))
            }
            Step::Attach(edge, yes) => Some(format!("attach {}? {}", arrow(edge), u8::from(yes))),
            _ => None,
        };
        self.steps.iter().filter_map(question).collect()
    }

    /// Of each coordinate: axis, expected, variance; octave, shift, origin, phase, token, beyond, low, found.
    fn coordinates(&self) -> Vec<(usize, f32, f32, [i64; 8])> {
        let row = |step: &Step| {
            let Step::Coordinate(it) = *step else { return None };
            let Coordinate {
                axis,
                start: _,
                expected,
                variance,
                octave,
                shift,
                origin,
                phase,
                token,
                beyond,
                low,
                found,
            } = it;
            let integers = [octave, shift.into(), origin, phase as i64, token, beyond, low, found];
            Some((axis, expected, variance, integers))
        };
        self.steps.iter().filter_map(row).collect()
    }

    fn placed(&self) -> Vec<Placed> {
        let placed = |step: &Step| if let Step::Placed(it) = step { Some((**it).clone()) } else { None };
        self.steps.iter().filter_map(placed).collect()
    }

    fn axes(&self) -> Vec<[f32; 3]> {
        self.steps.iter().filter_map(|s| if let Step::Axes(abc) = s { Some(*abc) } else { None }).collect()
    }
}

#[test]
fn the_square() {
    let base = [0x04, 0x6F, 0x5F, 0x63, 0x8C, 0x82];
    let pass = Pass::of(&base, [4, 2], atom(REFINEMENT, 0, 2, 3, &[0x61, 0x56, 0xDB, 0x22, 0xBD, 0x05]));
    let points = [('A', [0, 0, 0]), ('B', [255, 0, 0]), ('C', [255, 255, 0]), ('D', [0, 255, 0])];
    assert_eq!(
        pass.questions(&points),
        [
            "split A→B? [1][1][8, 63] 0 0.8333333",
            "split B→C? [1][1][8, 63] 0 0.8333333",
            "split C→A? [0][4][12, 67] 1 1.5",
            "attach A→B? 1",
        ]
    );
    assert_eq!(pass.mesh.points[4..], [[130, 120, 9], [128, 0, 40]]);
    assert_eq!(
        pass.coordinates(),
        [
            (0, -127.5, 2032.0315, [14, 4, -127, 0, 8, 0, 2, -125]),
            (1, -127.5, 2032.0315, [14, 4, -127, 0, 7, 0, 8, -135]),
            (2, 0.0, 508.00787, [12, 3, 0, 0, 9, 0, 1, 9]),
            (0, 127.5, 2601.0, [15, 4, 128, 0, 8, 0, 0, 128]),
            (1, 0.0, 2601.0, [15, 4, 0, 0, 8, 0, 0, 0]),
            (2, 0.0, 2601.0, [15, 4, 0, 0, 10, 0, 8, 40]),
        ]
    );
    let [v] = &pass.placed()[..] else { panic!("one split") };
    assert_eq!((v.frame.features, v.frame.classes, v.frame.octave), ([0.0; 2], [0; 3], 16));
    assert_eq!(v.errors, [0.009803922, 0.019607844, 0.02495671]);
    assert_eq!(v.means.map(|m| m.mean), [0.08196078, 0.08392157, 0.044991344]);
    assert_eq!(v.slopes.map(|s| (s.products, s.squares)), [(2.0, 4.0), (1.0, 4.0)]);
}

#[test]
fn the_square_from_a_coarser_lattice() {
    let mut draft = by_hand::file();
    draft.atoms = vec![
        atom(BASE, 1, 0, 0, &[0x04, 0x6F, 0x5F, 0x4E, 0x2E, 0xE0]),
        atom(PRECISION, 0, 8, 0, &[0x1E, 0x36, 0x64]),
        atom(REFINEMENT, 0, 2, 3, &[0x61, 0x56, 0xDB, 0x22, 0xBD, 0x05]),
    ];
    let in_other_pieces = agree(&by_hand::file().bytes()).unwrap();
    assert_eq!(agree(&draft.bytes()).unwrap(), in_other_pieces);
    // As the base stands in the middle of its cells.
    let level = Level { vertices: 4, triangles: 2, shift: 2, max_error: 0.0, rms_error: 0.0 };
    let mut points =
        keyframe::read(&draft.atoms[0].bytes, level, Scale { shift: level.shift, ..Scale::plain(8) })
            .unwrap()
            .points;
    points.sort_unstable();
    assert_eq!(points, [[2, 2, 2], [2, 254, 2], [254, 2, 2], [254, 254, 2]]);
}

#[test]
fn the_octahedron() {
    let base = [0, 0x5B, 0xFA, 0xAE, 0x2D, 0x66, 0x71, 0xE6, 0xED, 0x55, 0x67, 0xFC, 0x93, 0xC6, 0x2C];
    let code = [0x76, 0xEC, 0x7E, 0x7D, 0x6F, 0x62];
    let pass = Pass::of(&base, [6, 8], atom(REFINEMENT, 0, 3, 6, &code));
    let points = [
        ('A', [20, 10, 9]),
        ('B', [10, 21, 10]),
        ('C', [0, 10, 11]),
        ('D', [11, 0, 10]),
        ('E', [9, 10, 18]),
        ('F', [10, 10, 2]),
        ('G', [17, 18, 10]),
        ('H', [3, 3, 22]),
        ('I', [14, 4, 15]),
    ];
    assert_eq!(
        pass.questions(&points),
        [
            "split A→B? [0][0][10, 30] 1 1.1312102",
            "flip B→E, r = C? [3][1][0][5] 1 0.87817794",
            "flip E→A, r = D? [1][2][1][5] 0 0.74577713",
            "flip A→F, r = D? [2][1][1][6] 0 1.1938424",
            "flip C→E, r = D? [2][0][1][6] 0 2.2336366",
            "split E→D? [0][2][9, 29] 0 0.94448346",
            "split D→A? [0][2][9, 29] 0 0.9758713",
            "split D→F? [0][1][9, 29] 0 0.9315455",
            "split F→C? [0][2][10, 29] 0 1.0090592",
            "split C→D? [0][1][10, 30] 1 1.1903485",
            "flip D→E, r = A? [3][1][0][6] 0 1.2692795",
            "flip C→F, r = B? [6][1][0][6] 0 2.1634614",
            "flip F→D, r = A? [4][2][0][6] 0 2.1103792",
            "face DAE? 1",
        ]
    );
    assert_eq!(pass.mesh.points[6..], [[17, 18, 10], [3, 3, 22], [14, 4, 15]]);
    assert_eq!(
        pass.coordinates(),
        [
            (2, 1.0133209, 3.4631662, [5, 0, 1, 1, 8, 0, 0, 1]),
            (1, 6.5175934, 2.3002775, [5, 0, 7, 0, 9, 0, 0, 8]),
            (0, -4.6628428, 1.3098013, [4, 0, -5, 2, 10, 0, 0, -3]),
            (2, -0.97557986, 2.3124082, [5, 0, -1, 1, 15, 5, 0, 11]),
            (0, 3.785149, 1.8316073, [4, 0, 4, 0, 7, 0, 0, 3]),
            (1, -6.2926965, 1.249586, [4, 0, -6, 0, 7, 0, 0, -7]),
            (0, 2.3333335, 7.28, [6, 0, 2, 2, 9, 0, 0, 3]),
            (1, 6.666667, 7.28, [6, 0, 7, 0, 5, 0, 0, 4]),
            (2, 2.3333335, 7.28, [6, 0, 2, 2, 11, 0, 0, 5]),
        ]
    );
    assert_eq!(
        pass.axes(),
        [[-0.023304563, -0.025796255, -0.5622815], [-0.02472063, -0.013111711, -0.48074174], [0.0; 3],]
    );
    let [g, h] = &pass.placed()[..] else { panic!("two splits") };

    assert_eq!(g.frame.along.0, [-0.67115605, 0.73827165, 0.067115605]);
    assert_eq!(g.frame.across.0, [0.010741185, -0.080841556, 0.99666905]);
    assert_eq!(g.frame.normal.0, [0.74123824, 0.6696414, 0.04632739]);
    assert_eq!((g.frame.length, g.frame.octave), (14.899665, 7));
    assert_eq!((g.frame.features, g.frame.classes), ([0.05932258, 0.4221569], [3, 2, 5]));
    assert_eq!((g.deviations, g.shifts), ([0.1, 0.1, 0.05], [0.02966129, 0.105539225]));
    assert_eq!(g.expected.0, [-3.8296566, 6.517283, 1.0133209]);
    assert_eq!(g.errors, [0.036036037, 0.021323502, 0.21341042]);
    assert_eq!(g.means.map(|m| m.mean), [0.087207206, 0.08166756, 0.06157424]);
    assert_eq!(g.slopes.map(|s| (s.products, s.squares)), [(2.1264966, 4.351917), (37.037075, 75.28658)]);
    assert_eq!(g.slopes[0].slope(), 0.48863447);

    assert_eq!(h.frame.along.0, [0.73827165, -0.67115605, -0.067115605]);
    assert_eq!(h.frame.across.0, [0.021209685, -0.07635486, 0.99685514]);
    assert_eq!(h.frame.normal.0, [-0.67416996, -0.7373734, -0.042135622]);
    assert_eq!((h.frame.length, h.frame.octave), (14.899665, 7));
    assert_eq!((h.frame.features, h.frame.classes), ([-0.05338128, 0.56170315], [3, 2, 6]));
    assert_eq!((h.deviations, h.shifts), ([0.087207206, 0.08166756, 0.05], [-0.026083933, 0.14042579]));
    assert_eq!(h.expected.0, [4.081193, -6.5131297, -0.97557986]);
    assert_eq!(h.errors, [-0.08558559, 0.7760926, 0.17957531]);
    assert_eq!(h.means.map(|m| m.mean), [0.086936936, 0.2017524, 0.047829904]);
    assert_eq!(h.slopes.map(|s| (s.products, s.squares)), [(-4.085102, 4.7791634), (41.347206, 130.20418)]);
}

/// The examples of §10.5, §10.6 and §11.4: what they hold, and that the crate writes them so.
#[test]
fn the_square_exactly_and_in_order() {
    let correction = [
        0x94, 0x1A, 0xB9, 0x2D, 0x99, 0xCC, 0x4B, 0xED, 0x5D, 0x4E, 0x18, 0x9E, 0xA2, 0xFB, 0x2F, 0x1B, 0x80,
    ];
    let order = [0x95, 0x50, 0x8A];
    let file = |beyond: Vec<Atom>| {
        let atoms = vec![atom(BASE, 0, 0, 0, &[0x04, 0x6F, 0x5F, 0x63, 0x8C, 0x82])];
        let mut draft = base_alone(4, 2, atoms.into_iter().chain(beyond).collect());
        (draft.origin, draft.step) = ([0.0; 3], 0.01);
        draft.bytes()
    };
    let positions = [[0.0, 0.0, 0.0], [2.55, 0.0, -0.0], [2.549, 2.55, 0.0], [0.0, 2.5501, 0.0]];
    let triangles = [[2, 0, 1], [3, 0, 2]];
    let bits = |positions: &[[f64; 3]]| -> Vec<_> { positions.iter().map(|p| p.map(f64::to_bits)).collect() };

    let square = decode(&file(vec![]), decoder::Options::default()).unwrap();
    let (mesh, lattice) = (square.mesh(), square.contents().unwrap().header.lattice);
    let (residue, tour) = (Residue::default(), Tour::new(mesh));
    let whole = Whole::new(mesh, &residue, &tour);
    let all = Grid::Binary { dropped: 0 };
    let grids = [
        vec![Grid::Decimal { digits: 4, places: 3 }],
        vec![Grid::Decimal { digits: 3, places: 2 }, all],
        vec![Grid::Decimal { digits: 1, places: 0 }],
    ];
    let told =
        Correction { real: Real::Binary64, grids, positions: positions.to_vec(), ..Default::default() };
    assert_eq!(told.encode(&whole, &lattice, &mut Budget::unlimited()).unwrap(), correction);
    let corrected = agree(&file(vec![atom(CORRECTION, 0, 0, 0, &correction)])).unwrap().whole;
    assert_eq!(bits(&corrected.positions), bits(&positions));
    assert_eq!(corrected.triangles, triangles);

    // §10.6: a copy of A at the second triangle, one of C at the first.
    let copies = vec![
        Copied { vertex: 0, position: [0.0, 0.0, -0.0] },
        Copied { vertex: 2, position: [2.551, 2.55, 0.0] },
    ];
    let with_copies = Correction { copies, corners: vec![(0, 1), (4, 0)], ..told };
    let payload = [
        0x94, 0x1A, 0xB9, 0x2D, 0x99, 0xCC, 0x4B, 0xED, 0x5D, 0x4E, 0x18, 0x9E, 0xA2, 0xFB, 0x2F, 0x1C, 0x5B,
        0x65, 0xC9, 0xD8, 0x40,
    ];
    assert_eq!(with_copies.encode(&whole, &lattice, &mut Budget::unlimited()).unwrap(), payload);
    let copied = agree(&file(vec![atom(CORRECTION, 0, 0, 0, &payload)])).unwrap().whole;
    let all = [&positions[..], &[[0.0, 0.0, -0.0], [2.551, 2.55, 0.0]]].concat();
    assert_eq!(bits(&copied.positions), bits(&all));
    assert_eq!(copied.triangles, [[5, 0, 1], [3, 4, 2]]);

    // D, A, B, C and A once more; the second triangle first, with the other A.
    let triangles = vec![[4, 3, 0], [1, 2, 3]];
    let told = Order { vertices: vec![3, 0, 1, 2, 0], triangles, ..Order::default() };
    let (payload, work) = told.encode(mesh, &residue, &tour.walk, &whole, 4, &[(1, 1), (0, 1)]).unwrap();
    // Two triangles, four vertices, and the second A, by 1,024.
    assert_eq!((&payload[..], work), (&order[..], 64 * 6 + 16 * 1024));
    let both = vec![atom(CORRECTION, 0, 0, 0, &correction), atom(ORDER, 0, 0, 0, &order)];
    let ordered = agree(&file(both)).unwrap().whole;
    assert_eq!(bits(&ordered.positions), bits(&[3, 0, 1, 2, 0].map(|v| positions[v])));
    assert_eq!(ordered.triangles, [[4, 3, 0], [1, 2, 3]]);
}
