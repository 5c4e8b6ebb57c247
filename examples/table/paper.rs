//! The comparison of "Fast Stellar Mesh Simplification" (Vieira, Velho, Lopes, Tavares, Lewiner 2003), Tables 1 and 2: its
//! two ways to choose the next vertex, in this implementation.

use super::cases::Case;
use super::generate;
use super::measure::{geometric_mean, median, seconds};
use super::tables::{Cell, Table};
use unweld::mesh::topology::{self, Manifold, Weld};
use unweld::mesh::{Lattice, lattice};
use unweld::simplify::{self, Features, Method, Options, Simplified};

/// The paper's two tables, run on these meshes and on generated ones.
///
/// # Errors
/// Those of simplification.
pub fn tables(cases: &[Case], runs: usize) -> anyhow::Result<Vec<Table>> {
    let torus = Case::of("torus (generated)".to_owned(), generate::torus(104, 68, 1), 14)?;
    let terrain = Case::of("terrain (generated)".to_owned(), generate::terrain(54, 53, 1), 14)?;
    let large = Case::of("large terrain (generated)".to_owned(), generate::terrain(200, 200, 1), 14)?;
    let mut totals = Table::new("ffc and stellar: running time", &[TOTALS_NOTE], &TOTALS);
    let mut ratios = Vec::new();
    for case in cases.iter().chain([&torus, &terrain, &large]) {
        let (mut ffc, mut stellar) = (Vec::new(), Vec::new());
        let mut triangles = 0;
        for _ in 0..runs {
            ffc.push(simplify(case, Method::Ffc)?.0);
            let (time, simplified) = simplify(case, Method::Stellar)?;
            stellar.push(time);
            triangles = simplified.base.triangle_count();
        }
        let (ffc, stellar) = (median(ffc), median(stellar));
        ratios.push(ffc / stellar);
        totals.rows.push(vec![
            Cell::text(&case.name),
            Cell::Count(case.mesh.triangles.len() as u64),
            Cell::Count(triangles as u64),
            Cell::Number(ffc, 3),
            Cell::Number(stellar, 3),
            Cell::Number(ffc / stellar, 2),
            Cell::None,
        ]);
    }
    for (name, input, output, ffc, stellar) in PAPER_TOTALS {
        totals.rows.push(vec![
            Cell::Text(format!("paper: {name}")),
            Cell::Count(input),
            Cell::Count(output),
            Cell::Number(ffc, 3),
            Cell::Number(stellar, 3),
            Cell::None,
            Cell::Number(ffc / stellar, 2),
        ]);
    }
    let mut means = vec![Cell::None; TOTALS.len()];
    means[0] = Cell::text("geometric mean");
    means[5] = Cell::number(geometric_mean(ratios.into_iter()), 2);
    means[6] = Cell::number(geometric_mean(PAPER_TOTALS.iter().map(|row| row.3 / row.4)), 2);
    totals.foot.push(means);

    let mut routines = Table::new("ffc and stellar: share of the routines", &[ROUTINES_NOTE], &ROUTINES);
    if let Some(case) = cases.first() {
        for method in [Method::Ffc, Method::Stellar] {
            let (_, simplified) = simplify(case, method)?;
            let shares = shares(&simplified);
            let name = format!("{}, {}", case.name, if method == Method::Ffc { "ffc" } else { "stellar" });
            let mut row = vec![Cell::Text(name)];
            row.extend((0..ROUTINES.len() - 1).map(|k| Cell::number(shares[k], 1)));
            routines.rows.push(row);
        }
    }
    for (name, shares) in PAPER_ROUTINES {
        let mut row = vec![Cell::text(name)];
        row.extend(shares.map(|share| Cell::number(share, 1)));
        routines.rows.push(row);
    }
    Ok(vec![totals, routines])
}

/// Simplifies to the paper's share of the vertices; seconds and result.
fn simplify(case: &Case, method: Method) -> anyhow::Result<(f64, Simplified)> {
    let Manifold { table, positions, locked } = topology::condition(&case.mesh, Weld::Exact).manifold;
    let (min, max) = lattice::bounds(positions.iter().copied()).unwrap_or_default();
    let lattice = Lattice::over(min, max, case.bits);
    let base_vertices = (positions.len() as f64 * PAPER_SHARE) as usize;
    let options = Options { method, base_vertices: Some(base_vertices), ..Options::default() };
    let (time, simplified) = seconds(|| {
        simplify::simplify(table, &positions, locked, Features::default(), &lattice, &options, &mut |_, _| {
            true
        })
    });
    Ok((time, simplified?))
}

/// Share of each routine in the time of a simplification, in percent, in the order of the columns; what is not told apart is none.
fn shares(simplified: &Simplified) -> [Option<f64>; ROUTINES.len() - 1] {
    let seconds = &simplified.seconds;
    let percent = |part: f64| Some(part / seconds.total() * 100.0);
    [
        percent(seconds.assign),
        percent(seconds.cost),
        percent(seconds.choose + seconds.classes),
        percent(seconds.plan),
        percent(seconds.remove),
        None,
        percent(seconds.cover + seconds.measure),
    ]
}

/// What remains of the paper's bunny: 260 triangles of 9,672.
const PAPER_SHARE: f64 = 260.0 / 9672.0;

/// The paper's Table 2: model, triangles in and out, seconds of FFC and of Fast Stellar.
const PAPER_TOTALS: [(&str, u64, u64, f64, f64); 4] = [
    ("bunny", 9672, 260, 7.32, 4.13),
    ("cow", 5804, 202, 4.68, 2.78),
    ("terrain", 5708, 190, 4.52, 2.69),
    ("torus", 14144, 344, 9.1, 5.11),
];

/// The paper's Table 1 (bunny), in percent.
const PAPER_ROUTINES: [(&str, [Option<f64>; ROUTINES.len() - 1]); 2] = [
    ("paper: bunny, ffc", [Some(1.26), Some(90.51), Some(4.14), Some(1.90), Some(1.95), Some(0.24), None]),
    ("paper: bunny, fs", [Some(1.95), Some(87.54), Some(6.04), Some(1.56), Some(2.50), Some(0.41), None]),
];

const TOTALS: [&str; 7] =
    ["mesh", "triangles in", "out", "ffc s", "stellar s", "ffc/stellar", "paper's ffc/fs"];
const ROUTINES: [&str; 8] = [
    "mesh, method",
    "assign quadrics %",
    "compute cost %",
    "queue or choice %",
    "flips %",
    "removal %",
    "update quadrics %",
    "error of the levels %",
];

const TOTALS_NOTE: &str = "`unweld::simplify` alone, CPU time, medians, the methods in turn, down to 2.7 % of the vertices as in the paper; its meshes \
    are not at hand but for larger or generated ones. Below them the paper's own figures, of 2003.";
const ROUTINES_NOTE: &str = "Percent of the running time by routine, and the paper's (its Table 1). Here the flips are planned \
    with the removal of each vertex, and carried out, with the quadrics handed on, as part of it.";
