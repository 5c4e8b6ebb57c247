//! What the papers of the simplifiers report, beside ours.

use super::tables::{Cell, Table};

/// Times and memory of Chen and others (2006), and times of the octree paper.
pub fn tables() -> Vec<Table> {
    let mut hqms = Table::new("The papers' figures: HQMS, 2006", &[HQMS_NOTE], &HQMS);
    for (model, vertices, triangles, memory, seconds) in PAPER_HQMS {
        let mut row = vec![Cell::text(model), Cell::Count(triangles)];
        let [qslim, mca, ours] = seconds.map(|s| (s > 0).then_some(s as f64));
        row.extend([qslim, mca, ours].map(|s| Cell::number(s, 0)));
        let over = |x: Option<f64>| x.zip(ours).map(|(x, ours)| x / ours);
        row.extend([over(qslim), over(mca)].map(|ratio| Cell::number(ratio, 1)));
        let bytes = memory.map(|kb| (kb > 0).then_some(kb as f64 * 1024.0 / vertices as f64));
        row.extend(bytes.map(|bytes| Cell::number(bytes, 0)));
        hqms.rows.push(row);
    }
    let mut octree = Table::new("The papers' figures: octree", &[OCTREE_NOTE], &OCTREE);
    for (model, before, after, uniform, seconds) in PAPER_OCTREE {
        octree.rows.push(vec![
            Cell::text(model),
            Cell::Count(before),
            Cell::Count(after),
            Cell::Number(uniform, 2),
            Cell::Number(seconds, 2),
            Cell::Number(seconds / uniform, 2),
        ]);
    }
    vec![hqms, octree]
}

/// Model, vertices, triangles, KB and seconds of QSlim, MCA and HQMS; 0 where there is none.
type Reported = (&'static str, u64, u64, [u64; 3], [u64; 3]);

const PAPER_HQMS: [Reported; 8] = [
    ("rabbit", 67_038, 134_074, [25_048, 12_936, 6_608], [4, 2, 1]),
    ("dragon", 437_645, 871_414, [158_136, 81_160, 40_052], [26, 17, 6]),
    ("buddha", 543_652, 1_087_716, [197_152, 100_760, 49_888], [32, 21, 7]),
    ("blade", 882_954, 1_765_388, [314_444, 161_488, 78_808], [50, 34, 12]),
    ("david", 3_614_098, 7_227_031, [0, 657_952, 314_840], [0, 162, 55]),
    ("dawn", 3_432_236, 6_594_103, [0, 616_188, 293_884], [0, 143, 50]),
    ("youthful", 1_728_305, 3_411_563, [613_848, 312_872, 148_672], [110, 70, 25]),
    ("awakening", 2_057_930, 4_060_497, [735_304, 372_164, 178_388], [136, 83, 30]),
];

/// Model, triangles before and after, seconds of uniform cells and of the octree's.
const PAPER_OCTREE: [(&str, u64, u64, f64, f64); 3] = [
    ("head", 1_355, 597, 0.31, 0.52),
    ("terrain", 8_192, 2_057, 2.33, 4.56),
    ("bunny", 69_374, 2_772, 20.60, 44.02),
];

const HQMS: [&str; 10] = [
    "model",
    "triangles",
    "QSlim s",
    "MCA s",
    "HQMS s",
    "QSlim/HQMS",
    "MCA/HQMS",
    "QSlim B/vertex",
    "MCA B/vertex",
    "HQMS B/vertex",
];
const OCTREE: [&str; 6] = ["model", "triangles", "to", "uniform s", "octree s", "octree/uniform"];

const HQMS_NOTE: &str = "To 1,000 triangles on a Pentium 4 of 2.2 GHz with 1 GB; QSlim 2.0, multiple choice with 8. Seconds are printed whole, so the ratios are rough. \
    Of errors the paper has curves alone: HQMS lowest, then QSlim, then multiple choice.";
const OCTREE_NOTE: &str = "On an IBM RS6000. The paper measures no error.";
