//! Weight and inertia of the machine's own masses: what loads it beside the wrench on the tool.

use crate::given::Given;
use crate::reply::Answer;
use truepose_kernel::Machine;
use truepose_kernel::spatial::{
    Pose, Vector, add, cross, dot, norm, rotate, rotation_matrix, scale, subtract,
};
use truepose_kernel::statics::PlacedChain;

/// A mass, and where it is.
type Mass<T> = (f64, T);

/// The masses of a machine, kg, and what acts on each kilogram.
pub struct Weight {
    /// Weight of a kilogram, N, base axes.
    per_kilogram: Vector<f64>,
    /// The same less what the acceleration of the platform takes.
    on_platform: Vector<f64>,
    /// Its centre, platform axes.
    platform: Mass<Vector<f64>>,
    /// How far along each its centre is, of 1.
    struts: Vec<Mass<f64>>,
    /// At the base-side joint centre of each strut.
    bases: Vec<f64>,
    /// Tubes that the platform carries, one a limb, and their lengths, m.
    tubes: Vec<Mass<f64>>,
    /// Whether limbs bend under their own weight.
    pub sags: bool,
    /// What gives way at the base and at the platform end of each strut, m/N.
    ends: Vec<[f64; 2]>,
}

impl Weight {
    /// Reads `weight` of a bundle; None where nothing weighs.
    pub fn read(bundle: &Given<'_>, machine: &Machine) -> Answer<Option<Weight>> {
        let Some(given) = bundle.get("weight") else { return Ok(None) };
        let per_kilogram: Vector<f64> = given.item("per_kilogram")?.fixed()?;
        let acceleration: Vector<f64> = given.item("acceleration")?.fixed()?;
        let [mass, x, y, z] = given.item("platform")?.fixed()?;
        let struts = machine.struts.len();
        let pairs = |key: &str, count: usize| -> Answer<Vec<[f64; 2]>> {
            let given = given.item(key)?;
            let (numbers, rows) = given.rows(2)?;
            if rows != count {
                return given.refuse(format!("expected {count} rows"));
            }
            Ok(numbers.chunks(2).map(|row| [row[0], row[1]]).collect())
        };
        let masses = |rows: Vec<[f64; 2]>| rows.into_iter().map(|[mass, at]| (mass, at)).collect();
        let bases = given.item("bases")?;
        let at_bases = bases.numbers()?;
        if at_bases.len() != struts {
            return bases.refuse(format!("expected {struts} numbers"));
        }
        Ok(Some(Weight {
            per_kilogram,
            on_platform: subtract(per_kilogram, acceleration),
            platform: (mass, [x, y, z]),
            struts: masses(pairs("struts", struts)?),
            bases: at_bases,
            tubes: masses(pairs("tubes", machine.chains.len())?),
            sags: given.is_asked("sags")?,
            ends: pairs("ends", struts)?,
        }))
    }

    /// Weight of a kilogram, N, base axes.
    pub fn per_kilogram(&self) -> Vector<f64> {
        self.per_kilogram
    }

    /// Force and moment at the tool point, N and N m, base axes: of the platform, of its share of the
    /// struts, and of the tubes that it carries.
    ///
    /// Of a machine whose drives are at `joints`, its platform at `pose` and its struts' joint centres at `centres`.
    pub fn wrench(
        &self,
        machine: &Machine,
        joints: &[f64],
        pose: &Pose<f64>,
        centres: &[[Vector<f64>; 2]],
    ) -> [f64; 6] {
        let rotation = rotation_matrix(pose.rotation);
        let tool = [0, 1, 2].map(|k| machine.nominal[machine.tool + k]);
        let (mass, centre) = self.platform;
        let mut sum = [[0.0; 3]; 2];
        let mut act = |arm: Vector<f64>, force: Vector<f64>| {
            sum = [add(sum[0], force), add(sum[1], cross(arm, force))];
        };
        act(rotate(&rotation, subtract(centre, tool)), scale(self.on_platform, mass));
        for (&(mass, share), &[_, end]) in self.struts.iter().zip(centres) {
            act(subtract(end, pose.position), scale(self.per_kilogram, mass * share));
        }
        for (chain, &(mass, length)) in machine.chains.iter().zip(&self.tubes) {
            if mass > 0.0 {
                let place = (&rotation, pose.position);
                let limb = PlacedChain::new(machine, chain, &machine.nominal, joints, place);
                let [base, end] = limb.ends();
                let back = subtract(base, end);
                let arm = add(end, scale(back, 0.5 * length / norm(back)));
                act(arm, scale(self.on_platform, mass));
            }
        }
        let [[a, b, c], [d, e, f]] = sum;
        [a, b, c, d, e, f]
    }

    /// Forces at the base-side joint centres, N, base axes, strut after strut.
    pub fn base_forces(&self) -> Vec<f64> {
        self.bases.iter().flat_map(|&mass| scale(self.per_kilogram, mass)).collect()
    }

    /// By how much the force at the base and at the platform end of a strut, whose joint centres these are,
    /// is above the mean along it, N.
    pub fn over_tension(&self, strut: usize, [base, end]: [Vector<f64>; 2]) -> [f64; 2] {
        let (mass, share) = self.struts[strut];
        let along = subtract(end, base);
        let weight = mass * dot(along, self.per_kilogram) / norm(along);
        [(1.0 - share) * weight, -share * weight]
    }

    /// By how much more a strut gives way than under the mean, m.
    pub fn uneven_stretch(&self, strut: usize, centres: [Vector<f64>; 2]) -> f64 {
        let [base, end] = self.over_tension(strut, centres);
        base * self.ends[strut][0] + end * self.ends[strut][1]
    }
}
