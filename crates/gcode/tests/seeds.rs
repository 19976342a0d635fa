//! The fuzzer's seeds, and programs made of them, without the fuzzer.

mod round_trip;

use std::path::Path;

fn seeds() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).unwrap()).collect()
}

/// Numbers of a linear congruential generator.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: usize) -> usize {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % count
    }
}

#[test]
fn seeds_keep_their_moves() {
    let seeds = seeds();
    assert!(seeds.len() >= 20);
    for seed in &seeds {
        for settings in 0..=255 {
            let mut data = seed.clone();
            data.push(settings);
            round_trip::check(&data);
        }
    }
}

/// How many programs are made of the seeds: `TRUEPOSE_GCODE_MUTATIONS`, as 1000000, or some.
fn mutations() -> usize {
    let count = std::env::var("TRUEPOSE_GCODE_MUTATIONS");
    count.map_or(100_000, |text| text.parse().expect("a number of programs"))
}

#[test]
fn lines_of_seeds_in_any_order_keep_their_moves() {
    let lines: Vec<Vec<u8>> = seeds()
        .iter()
        .flat_map(|seed| {
            seed.split_inclusive(|byte| *byte == b'\n').map(<[u8]>::to_vec).collect::<Vec<_>>()
        })
        .collect();
    let mut numbers = Numbers(1);
    for _ in 0..mutations() {
        let mut data = Vec::new();
        for _ in 0..1 + numbers.below(8) {
            data.extend_from_slice(&lines[numbers.below(lines.len())]);
        }
        for _ in 0..numbers.below(3) {
            let at = numbers.below(data.len());
            match numbers.below(3) {
                0 => data[at] = b"0123456789.-GXYIJRFN()/; \n"[numbers.below(26)],
                1 => drop(data.remove(at)),
                _ => data.insert(at, numbers.below(256) as u8),
            }
            if data.len() < 3 {
                break;
            }
        }
        data.push(numbers.below(256) as u8);
        round_trip::check(&data);
    }
}
