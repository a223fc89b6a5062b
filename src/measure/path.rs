//! Camera paths: keyframes in time, smooth between them, sampled at a fixed step, so that every run sees the same views.

use std::f64::consts::TAU;
use std::path::Path;

use crate::scene::{Camera, Scene};
use crate::{Error, Result};

/// Seconds that a built-in path takes.
const BUILTIN_SECONDS: f64 = 8.0;
/// Most views of a path.
const MOST_VIEWS: f64 = 100_000.0;

/// Where the camera is at a time, which is the scene's: what the wind moves is as it is then.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Seconds from the beginning.
    pub time: f64,
    /// East, north, above the ground there, m.
    pub position: [f64; 3],
    /// What it looks at, likewise.
    pub target: [f64; 3],
    /// Vertical field of view, degrees.
    pub vertical_fov: f64,
}

/// A path: at least one keyframe, times ascending.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// Name, for reports.
    pub name: String,
    keyframes: Vec<Keyframe>,
}

/// A path file in TOML.
#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct PathFile {
    keyframe: Vec<Keyframe>,
}

/// A row of a path file in CSV.
#[derive(serde::Deserialize)]
struct Row {
    time: f64,
    x: f64,
    y: f64,
    z: f64,
    target_x: f64,
    target_y: f64,
    target_z: f64,
    vertical_fov: f64,
}

impl CameraPath {
    /// The built-in paths with what they do; all start from a camera of the scene.
    pub const BUILTIN: [(&'static str, &'static str); 4] = [
        ("approach", "from behind the camera towards what it looks at, down among the trees"),
        ("orbit", "once around what the camera looks at, at its distance and height"),
        ("ridge-flight", "low over the ground from the camera to its target, looking ahead"),
        ("far-sweep", "a full turn high above the camera's place: the horizon all around"),
    ];

    /// A built-in path by name, from a camera of the scene.
    ///
    /// # Errors
    /// [`Error::Usage`] for an unknown name.
    pub fn builtin(name: &str, scene: &Scene, camera: &Camera) -> Result<Self> {
        let (p, t, vertical_fov) = (camera.position, camera.target, camera.vertical_fov);
        let (dx, dy) = (t[0] - p[0], t[1] - p[1]);
        let distance = dx.hypot(dy).max(1.0);
        let ahead = |s: f64, height: f64| [p[0] + s * dx, p[1] + s * dy, height];
        let count = 9;
        let at = |k: usize| k as f64 / (count - 1) as f64;
        let pose = |s: f64| -> Option<([f64; 3], [f64; 3])> {
            Some(match name {
                "approach" => {
                    let height = (p[2].max(3.0) * 1.5).powf(1.0 - s) * 3f64.powf(s);
                    (ahead(-0.2 + 0.9 * s, height), ahead(1.0, t[2].max(0.0)))
                }
                "orbit" => {
                    let angle = (-dy).atan2(-dx) + TAU * s;
                    let around = [t[0] + distance * angle.cos(), t[1] + distance * angle.sin(), p[2]];
                    (around, t)
                }
                "ridge-flight" => {
                    let height = p[2].clamp(10.0, 60.0);
                    (ahead(0.9 * s, height), ahead(0.9 * s + 0.3, 0.5 * height))
                }
                "far-sweep" => {
                    let angle = dy.atan2(dx) + TAU * s;
                    let height = p[2].max(300.0);
                    let look = [p[0] + 2000.0 * angle.cos(), p[1] + 2000.0 * angle.sin(), 0.4 * height];
                    ([p[0], p[1], height], look)
                }
                _ => return None,
            })
        };
        let inside = |mut q: [f64; 3]| {
            for (x, extent) in q.iter_mut().zip(scene.terrain.extent) {
                *x = x.clamp(0.0, extent);
            }
            q
        };
        let keyframes: Option<Vec<Keyframe>> = (0..count)
            .map(|k| {
                let (position, target) = pose(at(k))?;
                let time = BUILTIN_SECONDS * at(k);
                Some(Keyframe { time, position: inside(position), target, vertical_fov })
            })
            .collect();
        let keyframes = keyframes.ok_or_else(|| {
            let names = Self::BUILTIN.map(|b| b.0);
            let hint = crate::settings::nearest(name, names.iter().copied())
                .map_or(String::new(), |n| format!("did you mean \"{n}\"? "));
            Error::Usage(format!("no camera path \"{name}\"; {hint}there are: {}", names.join(", ")))
        })?;
        Ok(CameraPath { name: name.into(), keyframes })
    }

    /// A path from a file: CSV with the columns `time,x,y,z,target_x,target_y,target_z,vertical_fov`, or TOML with
    /// `[[keyframe]]` tables of `time`, `position`, `target`, `vertical_fov`; coordinates are those of the scene file.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Input`] for what is no path.
    pub fn load(file: &Path, scene: &Scene) -> Result<Self> {
        let text = std::fs::read_to_string(file).map_err(|e| Error::io(file, e))?;
        let remedy = "times ascend from 0; each keyframe has a position, a target and a field of view";
        let wrong = |what: String| Error::input(file, "", what, remedy);
        let keyframes = if file.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
            let rows: std::result::Result<Vec<Row>, csv::Error> = reader.deserialize().collect();
            let rows = rows.map_err(|e| wrong(e.to_string()))?;
            let keyframe = |r: Row| Keyframe {
                time: r.time,
                position: [r.x, r.y, r.z],
                target: [r.target_x, r.target_y, r.target_z],
                vertical_fov: r.vertical_fov,
            };
            rows.into_iter().map(keyframe).collect()
        } else {
            toml::from_str::<PathFile>(&text).map_err(|e| wrong(e.to_string()))?.keyframe
        };
        let origin = scene.terrain.origin;
        let moved = |q: [f64; 3]| [q[0] - origin[0], q[1] - origin[1], q[2]];
        let keyframes: Vec<Keyframe> = keyframes
            .into_iter()
            .map(|k| Keyframe { position: moved(k.position), target: moved(k.target), ..k })
            .collect();
        let name = file.file_stem().map_or("path".into(), |s| s.to_string_lossy().into_owned());
        Self::new(name, keyframes).map_err(wrong)
    }

    /// Cameras, a second each: in steps of one second, its views are these.
    pub fn through(name: &str, cameras: &[Camera]) -> Self {
        // The last one twice: views end before the end.
        let all = cameras.iter().chain(cameras.last()).enumerate();
        let keyframe = |(k, c): (usize, &Camera)| Keyframe {
            time: k as f64,
            position: c.position,
            target: c.target,
            vertical_fov: c.vertical_fov,
        };
        CameraPath { name: name.into(), keyframes: all.map(keyframe).collect() }
    }

    /// A path through keyframes; says what is wrong with them.
    fn new(name: String, keyframes: Vec<Keyframe>) -> std::result::Result<Self, String> {
        if keyframes.is_empty() {
            return Err("no keyframe".into());
        }
        for (k, frame) in keyframes.iter().enumerate() {
            let place = frame.position.iter().chain(&frame.target);
            if !place.chain([&frame.time, &frame.vertical_fov]).all(|v| v.is_finite()) {
                return Err(format!("keyframe {k} has something that is no finite number"));
            }
            if !(0.1..=170.0).contains(&frame.vertical_fov) {
                return Err(format!("keyframe {k}: a field of view of {} degrees", frame.vertical_fov));
            }
            if k > 0 && frame.time <= keyframes[k - 1].time {
                return Err(format!("keyframe {k} is not later than the one before"));
            }
        }
        Ok(CameraPath { name, keyframes })
    }

    /// Seconds from the first keyframe to the last.
    pub fn duration(&self) -> f64 {
        self.keyframes[self.keyframes.len() - 1].time - self.keyframes[0].time
    }

    /// Time of the scene at one of its views ([`CameraPath::views`]), s.
    pub fn time_of(&self, view: usize, step: f64) -> f64 {
        self.keyframes[0].time + view as f64 * step
    }

    /// The keyframes.
    pub fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// The camera at a time after the first keyframe, s: cubic Hermite with finite-difference tangents (Catmull-Rom with
    /// keyframes at any times), held before the first and after the last.
    pub fn at(&self, seconds: f64) -> Camera {
        let all = &self.keyframes;
        let time = all[0].time + seconds;
        let last = all.len() - 1;
        let k = all.iter().rposition(|f| f.time <= time).unwrap_or(0).min(last.saturating_sub(1));
        let (a, b) = (&all[k], &all[(k + 1).min(last)]);
        let span = b.time - a.time;
        let s = if span > 0.0 { ((time - a.time) / span).clamp(0.0, 1.0) } else { 0.0 };
        let tangent = |i: usize, value: &dyn Fn(&Keyframe) -> f64| {
            let (before, after) = (&all[i.saturating_sub(1)], &all[(i + 1).min(last)]);
            let span = after.time - before.time;
            if span > 0.0 { (value(after) - value(before)) / span } else { 0.0 }
        };
        let blend = |value: &dyn Fn(&Keyframe) -> f64| {
            let (s2, s3) = (s * s, s * s * s);
            let (m0, m1) = (tangent(k, value) * span, tangent((k + 1).min(last), value) * span);
            (2.0 * s3 - 3.0 * s2 + 1.0) * value(a)
                + (s3 - 2.0 * s2 + s) * m0
                + (3.0 * s2 - 2.0 * s3) * value(b)
                + (s3 - s2) * m1
        };
        Camera {
            name: self.name.clone(),
            position: std::array::from_fn(|i| blend(&|f: &Keyframe| f.position[i])),
            target: std::array::from_fn(|i| blend(&|f: &Keyframe| f.target[i])),
            vertical_fov: blend(&|f: &Keyframe| f.vertical_fov).clamp(0.1, 170.0),
        }
    }

    /// The views at a fixed step, s, from the beginning to before the end (one view for a path without duration).
    ///
    /// # Errors
    /// [`Error::Usage`] for a step that is not positive, or gives too many views.
    pub fn views(&self, step: f64) -> Result<Vec<Camera>> {
        let count = (self.duration() / step - 1e-9).ceil().max(1.0);
        if !(step > 0.0 && count <= MOST_VIEWS) {
            return Err(Error::Usage(format!("a path of {} s in steps of {step} s", self.duration())));
        }
        Ok((0..count as usize).map(|k| self.at(k as f64 * step)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line() -> CameraPath {
        let frame = |time: f64| Keyframe {
            time,
            position: [10.0 * time, 5.0, 2.0],
            target: [0.0, 10.0 * time, 0.0],
            vertical_fov: 50.0,
        };
        CameraPath::new("line".into(), [1.0, 2.0, 4.0, 5.0].map(frame).to_vec()).unwrap()
    }

    #[test]
    fn views_through_cameras_are_these() {
        let camera = |k: f64| Camera {
            name: "path".into(),
            position: [k * k, 2.0, 3.0],
            target: [0.0, k, 1.0],
            vertical_fov: 40.0 + k,
        };
        let all = [1.0, 3.0, 2.0].map(camera);
        assert_eq!(CameraPath::through("path", &all).views(1.0).unwrap(), all);
        assert_eq!(CameraPath::through("path", &all[..1]).views(1.0).unwrap(), all[..1]);
    }

    /// Tangents of a straight line at constant speed are exact, whatever the keyframes' spacing.
    #[test]
    fn a_straight_line_stays_one() {
        let path = line();
        for k in 0..=40 {
            let t = 0.1 * f64::from(k);
            let camera = path.at(t);
            assert!((camera.position[0] - 10.0 * (1.0 + t)).abs() < 1e-12, "{t}: {:?}", camera.position);
            assert!((camera.target[1] - 10.0 * (1.0 + t)).abs() < 1e-12);
            // Interpolation rounds.
            assert!((camera.vertical_fov - 50.0).abs() < 1e-12);
        }
        assert_eq!(path.at(-1.0), path.at(0.0));
        assert_eq!(path.at(9.0), path.at(4.0));
    }

    #[test]
    fn views_are_those_of_the_step() {
        let path = line();
        let views = path.views(0.5).unwrap();
        assert_eq!(views.len(), 8);
        assert_eq!(views[3], path.at(1.5));
        // The scene's time is that of the keyframes, which begin at one second.
        assert_eq!([path.time_of(0, 0.5), path.time_of(3, 0.5)], [1.0, 2.5]);
        assert!(path.views(0.0).is_err() && path.views(-1.0).is_err() && path.views(f64::NAN).is_err());
    }

    #[test]
    fn every_built_in_path_stays_over_the_terrain() {
        let scene = crate::scene::default_scene().unwrap();
        for (name, _) in CameraPath::BUILTIN {
            let path = CameraPath::builtin(name, &scene, &scene.cameras[0]).unwrap();
            let views = path.views(0.25).unwrap();
            assert_eq!(views.len(), 32);
            for v in &views {
                let [x, y, z] = v.position;
                let [w, h] = scene.terrain.extent;
                // Between keyframes on the border the curve may bulge out a little.
                assert!(
                    x > -0.1 * w && x < 1.1 * w && y > -0.1 * h && y < 1.1 * h && z > 1.0,
                    "{name}: {v:?}"
                );
            }
            assert!(views.windows(2).all(|w| w[0] != w[1]), "{name} moves");
        }
        let error = CameraPath::builtin("orbits", &scene, &scene.cameras[0]).unwrap_err().to_string();
        assert!(error.contains("did you mean \"orbit\"?"), "{error}");
    }

    #[test]
    fn files_of_both_kinds_say_the_same() {
        let dir = tempfile::tempdir().unwrap();
        let mut scene = crate::scene::default_scene().unwrap();
        scene.terrain.origin = [100.0, 200.0];
        let (csv, toml) = (dir.path().join("a.csv"), dir.path().join("a.toml"));
        let header = "time,x,y,z,target_x,target_y,target_z,vertical_fov\n";
        std::fs::write(&csv, format!("{header}0, 110,220,3, 120,230,1, 45\n2, 115,225,3, 120,230,1, 45\n"))
            .unwrap();
        let frame = |t: f64, x: f64, y: f64| {
            format!(
                "[[keyframe]]\ntime = {t:?}\nposition = [{x:?}, {y:?}, 3.0]\ntarget = [120.0, 230.0, 1.0]\nvertical_fov = 45.0\n"
            )
        };
        std::fs::write(&toml, frame(0.0, 110.0, 220.0) + &frame(2.0, 115.0, 225.0)).unwrap();
        let (a, b) = (CameraPath::load(&csv, &scene).unwrap(), CameraPath::load(&toml, &scene).unwrap());
        assert_eq!(a, b);
        assert_eq!(a.keyframes()[0].position, [10.0, 20.0, 3.0]);
        std::fs::write(&csv, format!("{header}1,0,0,3,1,1,1,45\n1,0,0,3,1,1,1,45\n")).unwrap();
        let error = CameraPath::load(&csv, &scene).unwrap_err().to_string();
        assert!(error.contains("keyframe 1 is not later"), "{error}");
    }
}
