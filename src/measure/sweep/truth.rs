//! References that a sweep path-traces itself, kept beside its result for when it goes on and for its shards.

use std::path::{Path, PathBuf};

use crate::camera::{Eye, auto_exposure};
use crate::image::Layers;
use crate::progress::Progress;
use crate::reference::{Options, World};
use crate::scene::{Camera, Scene};
use crate::{Error, Result};

/// Steps of the progress bar.
const STEPS: f64 = 1000.0;

/// What a kept reference is of, beside its image.
#[derive(PartialEq, serde::Serialize, serde::Deserialize)]
struct Label {
    /// BLAKE3 of everything that the samples depend on.
    samples: String,
    /// When it was good enough.
    until: String,
    /// BLAKE3 of the image's file.
    image: String,
}

/// Image of a camera's reference in a folder.
pub fn image_file(folder: &Path, camera: &Camera) -> PathBuf {
    folder.join(format!("{}.exr", camera.name))
}

fn label_file(folder: &Path, camera: &Camera) -> PathBuf {
    folder.join(format!("{}.reference.json", camera.name))
}

/// An image and a hash of its file.
///
/// # Errors
/// [`Error::Io`]; [`Error::Input`] for anything but a linear image.
pub fn read(file: &Path) -> Result<(Layers, String)> {
    let bytes = std::fs::read(file).map_err(|e| Error::io(file, e))?;
    Ok((Layers::read(file)?, crate::files::digest(&bytes)))
}

/// What to trace.
pub struct Request<'a> {
    /// The scene; its settings do not matter.
    pub scene: &'a Scene,
    /// From where.
    pub cameras: &'a [Camera],
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Which light, and how well. An error or a number of samples gives the same file wherever it is traced; a time does not.
    pub options: Options,
    /// Without progress.
    pub quiet: bool,
}

/// The reference of each camera, with a hash of its file: that in `folder`, else that of the first of `from` that has it, else
/// traced now; in `folder` afterwards.
///
/// # Errors
/// [`Error::Input`] for a kept reference of something else; [`Error::Usage`] for what cannot be traced; [`Error::Io`].
pub fn references(request: &Request, folder: &Path, from: &[PathBuf]) -> Result<Vec<(Layers, String)>> {
    let eye = |c: &Camera| Eye::new(c, &request.scene.terrain, request.size);
    let eyes: Vec<Eye> = request.cameras.iter().map(eye).collect();
    let world = World::new(request.scene, &eyes)?;
    let one = |(camera, eye): (&Camera, &Eye)| {
        let mut wanted = Label {
            samples: world.key(eye, &request.options).digest(),
            until: format!("{:?}", request.options.until),
            image: String::new(),
        };
        if let Some(kept) = kept(folder, camera, &mut wanted)? {
            return Ok(kept);
        }
        for other in from {
            if let Some(found) = kept(other, camera, &mut wanted)? {
                let file = image_file(other, camera);
                let bytes = std::fs::read(&file).map_err(|e| Error::io(&file, e))?;
                crate::files::write_whole(&image_file(folder, camera), &bytes)?;
                wanted.write(&label_file(folder, camera))?;
                return Ok(found);
            }
        }
        let progress = Progress::new("tracing the reference", STEPS as u64, request.quiet);
        let estimate = world.render(eye, &request.options, None, &mut |p| {
            let error = 100.0 * p.estimate.relative_error();
            let note = format!("{}: error {error:.2} %, {} spp", camera.name, p.estimate.samples);
            progress.set((STEPS * p.done) as u64, &note);
        })?;
        progress.finish();
        let file = image_file(folder, camera);
        estimate.picture(auto_exposure(request.scene)).write_exr(&file)?;
        let found = read(&file)?;
        wanted.image = found.1.clone();
        wanted.write(&label_file(folder, camera))?;
        Ok(found)
    };
    request.cameras.iter().zip(&eyes).map(one).collect()
}

impl Label {
    fn write(&self, file: &Path) -> Result<()> {
        let text = serde_json::to_string(self).map_err(|e| Error::io(file, std::io::Error::other(e)))?;
        crate::files::write_whole(file, (text + "\n").as_bytes())
    }
}

/// A camera's reference that a folder has, whose hash `wanted` gets; `None` if there is none, or one that was not finished.
fn kept(folder: &Path, camera: &Camera, wanted: &mut Label) -> Result<Option<(Layers, String)>> {
    let (label, image) = (label_file(folder, camera), image_file(folder, camera));
    if !label.exists() || !image.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&label).map_err(|e| Error::io(&label, e))?;
    let found: Option<Label> = serde_json::from_str(&text).ok();
    let (layers, hash) = read(&image)?;
    wanted.image = hash.clone();
    if found.as_ref() == Some(wanted) {
        return Ok(Some((layers, hash)));
    }
    let what = "a reference of something else: another scene, camera, size, light, goal, or changed since";
    let remedy = format!("give another folder, or remove it and {}", label.display());
    Err(Error::input(&image, "", what, remedy))
}
