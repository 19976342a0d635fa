//! Bounds of the error over a region of commanded poses, by branch and bound: the part of the region with
//! the highest bound is halved until no bound lies above an error reached somewhere by more than the gap.
//!
//! Where sizes have targets the question is whether all is below them: the search ends where that is so, or
//! where an error above one is met, and no bound need be closer.
//!
//! What is reached is looked for in the middle of every part, and at the corners of the region first, where
//! errors are largest as a rule. A part is halved along the freedom in which it is the most steps long. A step
//! is the length along that freedom alone, about the middle of the region, over which the bound lies above
//! what is reached by the gap.

use super::Unproven;
use super::over_region::{Look, middle_of, sides_at};
use super::region::Region;
use super::targets::{AS_LOW_AS_CAN_BE, TARGETS};
use crate::batch::share_out;
use crate::linear::SIX;
use crate::status::Status;

/// Parts that are halved together, and most of them where many wait.
const BATCH: usize = 32;
const LARGEST_BATCH: usize = 256;
/// A part of less than this share of the region along every axis is not halved.
const SMALLEST: f64 = 1e-4;
/// A component below this share of its magnitude is closed to the gap of this share.
const MINOR: f64 = 0.1;

/// A part of a region.
#[derive(Clone, Debug)]
pub struct Part {
    /// Lowest and highest value of each commanded freedom.
    pub sides: Vec<[f64; 2]>,
    /// What is proven of the targets in it, if anything is: of itself, or of what it is a part of.
    pub bound: Option<[f64; TARGETS]>,
    state: State,
}

#[derive(Clone, Copy, Debug)]
enum State {
    Fresh,
    Proven,
    Unproven(Unproven),
}

impl Part {
    /// A part that was looked at, and its bound, if there is one.
    pub fn known(sides: Vec<[f64; 2]>, bound: Option<[f64; TARGETS]>) -> Part {
        let state = match bound {
            Some(_) => State::Proven,
            None => State::Unproven(Unproven::TooWide),
        };
        Part { sides, bound, state }
    }

    /// What a look at it found, where that is closer than what is known.
    fn take(&mut self, found: Result<[f64; TARGETS], Unproven>) {
        match found {
            Ok(mut own) => {
                for (own, known) in own.iter_mut().zip(self.bound.iter().flatten()) {
                    *own = own.min(*known);
                }
                self.bound = Some(own);
                self.state = State::Proven;
            }
            Err(why) => self.state = State::Unproven(why),
        }
    }

    /// The widest side, relative to the region's.
    fn widest(&self, region: &Region<'_>) -> f64 {
        (0..self.sides.len()).map(|k| self.share(region, k)).fold(0.0, f64::max)
    }

    /// A side, relative to the region's.
    fn share(&self, region: &Region<'_>, k: usize) -> f64 {
        let ([low, high], [from, to]) = (self.sides[k], region.sides[k]);
        if to > from { (high - low) / (to - from) } else { 0.0 }
    }

    /// Its share of the region.
    fn volume(&self, region: &Region<'_>) -> f64 {
        let extended = (0..self.sides.len()).filter(|&k| region.sides[k][1] > region.sides[k][0]);
        extended.map(|k| self.share(region, k)).product()
    }

    /// Halved along the side that is longest in `steps` (shares of the region's sides).
    fn halves(&self, region: &Region<'_>, steps: &[f64]) -> [Part; 2] {
        let share = |&k: &usize| self.share(region, k) / steps[k];
        let widest =
            (0..self.sides.len()).max_by(|a, b| share(a).total_cmp(&share(b))).unwrap_or(0);
        let middle = middle_of(&self.sides)[widest];
        [0, 1].map(|half| {
            let mut sides = self.sides.clone();
            sides[widest][1 - half] = middle;
            Part { sides, bound: self.bound, state: State::Fresh }
        })
    }
}

/// How far a search is.
#[derive(Clone, Debug)]
pub struct Search {
    /// Parts of the region that are not finished.
    pub parts: Vec<Part>,
    /// Bounds of the targets over the parts that are.
    pub finished: [f64; TARGETS],
    /// What is reached of each target.
    pub reached: [f64; TARGETS],
    /// Where: commanded freedoms.
    pub at: Vec<Vec<f64>>,
    /// Boxes looked at.
    pub boxes: usize,
}

impl Search {
    /// Before its beginning.
    pub fn new(region: &Region<'_>) -> Search {
        let whole = Part { sides: region.sides.clone(), bound: None, state: State::Fresh };
        Search {
            parts: vec![whole],
            finished: AS_LOW_AS_CAN_BE,
            reached: AS_LOW_AS_CAN_BE,
            at: vec![vec![f64::NAN; region.sides.len()]; TARGETS],
            boxes: 0,
        }
    }

    /// The highest bounds that close the targets; as low as can be before all are reached.
    fn allowed(&self, region: &Region<'_>) -> [f64; TARGETS] {
        if let Some(sizes) = region.targets {
            let mut allowed = [f64::INFINITY; TARGETS];
            allowed[2 * SIX..].copy_from_slice(&sizes);
            allowed
        } else if self.reached.contains(&f64::NEG_INFINITY) {
            AS_LOW_AS_CAN_BE
        } else {
            allowed_bounds(&self.reached, region.gap)
        }
    }

    /// Whether an error above a target was met.
    fn is_refuted(&self, region: &Region<'_>) -> bool {
        let sizes = self.reached[2 * SIX..].iter();
        region.targets.is_some_and(|targets| sizes.zip(targets).any(|(&size, most)| size > most))
    }

    /// Look at the parts that are fresh, side by side; a pose that the machine cannot be commanded to.
    fn look(&mut self, region: &Region<'_>) -> Result<(), (Status, Vec<f64>)> {
        let allowed = self.allowed(region);
        let fresh = self.parts.iter_mut().filter(|part| matches!(part.state, State::Fresh));
        let mut looks: Vec<(&mut Part, Option<Look>)> = fresh.map(|part| (part, None)).collect();
        let count = looks.len();
        share_out(&mut looks, count, 1, |_, looks| {
            for (part, look) in looks {
                *look = Some(region.look(&part.sides, &allowed));
            }
        });
        self.boxes += count;
        for (part, look) in looks {
            let Some(look) = look else { continue };
            let middle = middle_of(&part.sides);
            if look.status != Status::Ok {
                return Err((look.status, middle));
            }
            part.take(look.bound);
            note((&mut self.reached, &mut self.at), &look.reached, &middle);
        }
        Ok(())
    }

    /// What is reached at the corners of the region, where it is more than one pose.
    fn look_at_corners(&mut self, region: &Region<'_>) {
        if region.sides.iter().all(|[low, high]| low == high) {
            return;
        }
        let mut corners = vec![Vec::new()];
        for &[low, high] in &region.sides {
            let ends = if high > low { vec![low, high] } else { vec![low] };
            let further = corners.iter().flat_map(|corner: &Vec<f64>| {
                ends.iter().map(|&end| [corner.as_slice(), &[end]].concat())
            });
            corners = further.collect();
        }
        let mut looks: Vec<(Vec<f64>, Option<Look>)> =
            corners.into_iter().map(|corner| (corner, None)).collect();
        let count = looks.len();
        share_out(&mut looks, count, 1, |_, looks| {
            for (corner, look) in looks {
                *look = Some(region.look_at(corner));
            }
        });
        for (corner, look) in looks {
            if let Some(look) = look {
                note((&mut self.reached, &mut self.at), &look.reached, &corner);
            }
        }
    }

    /// Finish the parts that cannot rise above the allowed bounds, and bring the others into order, the
    /// highest bound first.
    fn finish(&mut self, region: &Region<'_>) {
        let allowed = self.allowed(region);
        let mut rest: Vec<(f64, Part)> = Vec::with_capacity(self.parts.len());
        for part in std::mem::take(&mut self.parts) {
            match part.bound {
                Some(bound) if (0..TARGETS).all(|target| bound[target] <= allowed[target]) => {
                    raise(&mut self.finished, &bound);
                }
                Some(bound) => rest.push((relative_excess(&bound, &allowed), part)),
                None => rest.push((f64::INFINITY, part)),
            }
        }
        rest.sort_by(|a, b| b.0.total_cmp(&a.0));
        self.parts = rest.into_iter().map(|(_, part)| part).collect();
    }

    /// Which share of the region is finished.
    fn finished_share(&self, region: &Region<'_>) -> f64 {
        1.0 - self.parts.iter().map(|part| part.volume(region)).sum::<f64>()
    }
}

/// What is proven over a region, and how far the search for it is.
#[derive(Clone, Debug)]
pub struct RegionBound {
    /// Bounds of the targets: components upwards, downwards (turned), magnitudes; infinite where nothing
    /// is proven.
    pub bound: [f64; TARGETS],
    /// By how much the bounds lie above the errors reached, in the measure of [`Region::gap`].
    pub gap: f64,
    /// Why a part of the region is not proven, and its middle.
    pub unproven: Option<(Unproven, Vec<f64>)>,
    /// A pose of the region that the machine cannot be commanded to.
    pub out_of_reach: Option<(Status, Vec<f64>)>,
    /// What a search that goes on begins with.
    pub search: Search,
}

/// Bounds over a region, from where `search` is.
///
/// `progress(boxes, share)` is called between batches with the share of the region that is finished;
/// false stops the search.
pub fn bound_over_region(
    region: &Region<'_>,
    mut search: Search,
    mut progress: impl FnMut(usize, f64) -> bool,
) -> RegionBound {
    let most_boxes = search.boxes + region.most_boxes;
    let none = [f64::INFINITY; TARGETS];
    let mut steps: Option<Vec<f64>> = None;
    if search.boxes == 0 {
        search.look_at_corners(region);
    }
    loop {
        if let Err(place) = search.look(region) {
            let out_of_reach = Some(place);
            return RegionBound {
                bound: none,
                gap: f64::INFINITY,
                unproven: None,
                out_of_reach,
                search,
            };
        }
        search.finish(region);
        let stop = search.parts.first().is_none_or(|first| first.widest(region) < SMALLEST)
            || search.boxes >= most_boxes
            || search.is_refuted(region)
            || !progress(search.boxes, search.finished_share(region));
        let given_up = search
            .parts
            .iter()
            .find(|part| part.bound.is_none() && (stop || part.widest(region) < SMALLEST));
        if let Some(part) = given_up {
            let why = match part.state {
                State::Unproven(why) => why,
                _ => Unproven::TooWide,
            };
            let unproven = Some((why, middle_of(&part.sides)));
            return RegionBound {
                bound: none,
                gap: f64::INFINITY,
                unproven,
                out_of_reach: None,
                search,
            };
        }
        if stop {
            let mut bound = search.finished;
            for part in &search.parts {
                raise(&mut bound, &part.bound.unwrap_or(none));
            }
            let gap = region.gap_of(&bound, &search.reached);
            return RegionBound { bound, gap, unproven: None, out_of_reach: None, search };
        }
        let halved =
            search.parts.len().min(BATCH.max(search.parts.len() / BATCH).min(LARGEST_BATCH));
        let rest = search.parts.split_off(halved);
        let steps = steps.get_or_insert_with(|| region.steps());
        let halves: Vec<[Part; 2]> =
            search.parts.iter().map(|part| part.halves(region, steps)).collect();
        // The two halves of a part take as long, and are looked at by different threads.
        let (lower, upper): (Vec<Part>, Vec<Part>) =
            halves.into_iter().map(<(Part, Part)>::from).unzip();
        search.parts = lower;
        search.parts.extend(upper);
        search.parts.extend(rest);
    }
}

impl Region<'_> {
    /// A pose of the region.
    fn look_at(&self, pose: &[f64]) -> Look {
        self.look(&sides_at(pose), &AS_LOW_AS_CAN_BE)
    }

    /// What the highest of the gaps is, of the sizes alone where these have targets.
    fn gap_of(&self, bound: &[f64; TARGETS], reached: &[f64; TARGETS]) -> f64 {
        let unit = allowed_bounds(reached, 1.0);
        let first = if self.targets.is_some() { 2 * SIX } else { 0 };
        (first..TARGETS)
            .filter(|&target| unit[target] > reached[target])
            .map(|target| (bound[target] - reached[target]) / (unit[target] - reached[target]))
            .fold(0.0, f64::max)
    }

    /// How long a part may be along each commanded freedom alone, as a share of the region, for its bound to
    /// lie above what is reached by about the gap.
    fn steps(&self) -> Vec<f64> {
        let middle = middle_of(&self.sides);
        let looks = (0..self.sides.len()).map(|k| {
            let [low, high] = self.sides[k];
            let mut step = 1.0;
            let mut wider: Option<f64> = None;
            while high > low && step > SMALLEST {
                let mut sides = sides_at(&middle);
                let half = 0.5 * step * (high - low);
                sides[k] = [middle[k] - half, middle[k] + half];
                let Look { bound, mut reached, .. } = self.look(&sides, &AS_LOW_AS_CAN_BE);
                for end in sides[k] {
                    let mut pose = middle.clone();
                    pose[k] = end;
                    for (reached, there) in reached.iter_mut().zip(self.look_at(&pose).reached) {
                        *reached = reached.max(there);
                    }
                }
                let gap = bound.map_or(f64::INFINITY, |bound| self.gap_of(&bound, &reached));
                if gap <= self.gap {
                    // Between this and the one of twice the length.
                    return wider.map_or(step, |wider| step * wider);
                }
                wider = Some((2.0 * (self.gap / gap).sqrt()).max(1.0));
                step *= 0.5;
            }
            step
        });
        looks.collect()
    }
}

/// What is reached at a pose, and what was known of that.
fn note(
    (reached, at): (&mut [f64; TARGETS], &mut [Vec<f64>]),
    found: &[f64; TARGETS],
    pose: &[f64],
) {
    for target in 0..TARGETS {
        if found[target] > reached[target] {
            reached[target] = found[target];
            at[target] = pose.to_vec();
        }
    }
}

/// The higher of two bounds, each.
fn raise(highest: &mut [f64; TARGETS], bound: &[f64; TARGETS]) {
    for (highest, &bound) in highest.iter_mut().zip(bound) {
        *highest = highest.max(bound);
    }
}

/// The highest bound of each target that closes it.
fn allowed_bounds(reached: &[f64; TARGETS], gap: f64) -> [f64; TARGETS] {
    let mut allowed = [0.0; TARGETS];
    for target in 0..TARGETS {
        let part = if target < 2 * SIX { target % SIX / 3 } else { target - 2 * SIX };
        let magnitude = reached[2 * SIX + part];
        let scale = reached[target].abs().max(MINOR * magnitude);
        allowed[target] = reached[target] + gap * scale;
    }
    allowed
}

/// By how much the worst target lies above its allowed bound, relative to that.
fn relative_excess(bound: &[f64; TARGETS], allowed: &[f64; TARGETS]) -> f64 {
    (0..TARGETS)
        .filter(|&target| allowed[target] < f64::INFINITY)
        .map(|target| {
            let scale = allowed[target].abs().max(f64::MIN_POSITIVE);
            (bound[target] - allowed[target]) / scale
        })
        .fold(0.0, f64::max)
}
