//! A frame: every pass in order, in [`Renderer::submit`].

pub mod accumulation;
pub mod canvas;
pub mod ground;
pub mod horizon;
pub mod receivers;
pub mod report;
pub mod seen_ground;
pub mod shadow_ground;
pub mod shadows;
pub mod sky;
pub mod stream;
pub mod targets;
pub mod tonemap;
pub mod trees;
pub mod view;
pub mod world;

use std::sync::Arc;

use tracing::info_span;

use crate::bake::Baked;
use crate::camera::{Cascade, Eye, Light};
use crate::clock::monotonic_ns;
use crate::forest::casters::CasterData;
use crate::forest::terrain::TerrainData;
use crate::gpu::interface::View;
use crate::gpu::{Gpu, Ring};
use crate::image::Picture;
use crate::plan::Plan;
use crate::scene::{Camera, Scene, Sun};
use crate::{Error, Result};
use accumulation::MARGIN;
use canvas::Canvas;
use report::{Began, ReadBacks};
use shadows::Shadows;
use stream::Moment;
use trees::meshes::Meshes;
use trees::tiles::TreeTiles;

pub use report::{FrameReport, Ticket, Tiles};
pub use world::{Forest, NearTrees, World};

/// An eye that looks for all that the frames of a picture show.
fn seen_by(eye: &Eye, plan: &Plan) -> Eye {
    Eye { margin: if plan.accumulation > 1 { MARGIN } else { 0.0 }, ..*eye }
}

/// Draws a scene as its plan says.
pub struct Renderer {
    gpu: Gpu,
    ring: Ring,
    scene: Arc<Scene>,
    plan: Plan,
    light: Light,
    time: f64,
    world: World,
    canvas: Canvas,
}

impl Renderer {
    /// Builds what the plan lists.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when that is not what its numbers ask for ([`Plan::list`]); [`crate::Error::Device`] when out of
    /// memory.
    pub fn new(gpu: &Gpu, scene: Arc<Scene>, plan: Plan, baked: &[Baked]) -> Result<Self> {
        let _build = info_span!("build").entered();
        plan.check_items(&scene)?;
        let world = World::new(gpu, (&scene, &plan), baked)?;
        Ok(Renderer {
            canvas: Canvas::new(gpu, (&scene, &plan), &world)?,
            world,
            ring: Ring::default(),
            light: Light::new(&scene),
            time: scene.time,
            gpu: gpu.clone(),
            scene,
            plan,
        })
    }

    /// Draws images of another size, or of other optics, from now on, as planned for them. The world stays, with what its
    /// caches hold, and its capacities with it; only what an image takes is made anew.
    ///
    /// # Errors
    /// [`Error::Usage`] when the plan takes another world, and why; [`Error::Device`] when out of memory. Then all is as it was.
    pub fn resize(&mut self, plan: &Plan) -> Result<()> {
        let plan = world::served(&self.scene, &self.plan, plan)?;
        let canvas = Canvas::new(&self.gpu, (&self.scene, &plan), &self.world)?;
        self.world.adapt(&self.gpu, &plan)?;
        (self.canvas, self.plan) = (canvas, plan);
        Ok(())
    }

    /// Draws one frame and waits for it.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when the view needs more quads or trees than the plan holds, or trees one by one where it has
    /// none; [`crate::Error::Device`].
    pub fn render(&mut self, camera: &Camera, exposure: f64) -> Result<FrameReport> {
        self.render_eye(&Eye::new(camera, &self.scene.terrain, self.plan.size), exposure).map(|(r, _)| r)
    }

    /// Draws one frame from an eye; also returns the view that the shaders got.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn render_eye(&mut self, eye: &Eye, exposure: f64) -> Result<(FrameReport, View)> {
        let cascades = self.cascades(eye);
        self.draw(eye, &cascades, exposure)
    }

    /// Draws one frame from an eye with the shadow cascades given, as many as the plan has.
    ///
    /// # Errors
    /// As [`Renderer::render`].
    pub fn draw(&mut self, eye: &Eye, cascades: &[Cascade], exposure: f64) -> Result<(FrameReport, View)> {
        let ticket = self.submit(eye, cascades, exposure)?;
        self.finish(ticket)
    }

    /// Has the device draw a frame, and does not wait for it. Frames may be in flight together, and are drawn in order:
    /// each gets the bits that it would get alone.
    ///
    /// # Errors
    /// As [`Renderer::render`], but for what is only found out while drawing: [`Renderer::finish`] says that.
    pub fn submit(&mut self, eye: &Eye, cascades: &[Cascade], exposure: f64) -> Result<Ticket> {
        let (light, time) = (self.light, self.time);
        let sent = self.record(Moment { eye, cascades, light: &light, exposure, time });
        sent.inspect_err(|_| self.world.forget())
    }

    /// Waits for a frame, and says what it took and drew, and the view that its shaders got.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] when more trees were in view than the plan holds; [`crate::Error::Device`].
    pub fn finish(&mut self, ticket: Ticket) -> Result<(FrameReport, View)> {
        self.complete(ticket).inspect_err(|_| self.world.forget())
    }

    /// Records a frame that takes what the ones before left to be drawn, and submits it.
    fn record(&mut self, moment: Moment) -> Result<Ticket> {
        let _frame = info_span!("frame").entered();
        let began = Began::now();
        let gpu = self.gpu.clone();
        let mut recorder = gpu.record_in(&self.ring)?;
        let (r, plan) = (&mut recorder, &self.plan);
        let stream = info_span!("stream").entered();
        let eye = seen_by(moment.eye, plan);
        let moment = Moment { eye: &eye, ..moment };
        let streamed = self.world.stream(r, (&self.scene, plan), moment)?;
        drop(stream);

        let (recording, record_ns) = (info_span!("record").entered(), monotonic_ns());
        self.world.produce(r, &streamed);
        self.world.visibility(r);
        self.world.shadows(r);
        for k in 0..plan.accumulation {
            self.world.look(r, plan, (&streamed, moment), k)?;
            self.canvas.draw(r, plan, &self.world, &streamed, moment);
            self.canvas.accumulate(r, plan, k);
        }
        self.canvas.resolve(r, plan, moment);
        let mut reads = ReadBacks::default();
        self.world.read(r, moment.cascades.len(), &mut reads)?;
        self.canvas.read(r, (plan, &self.world), &mut reads)?;
        drop(recording);

        let flight = info_span!("submit").in_scope(|| recorder.launch())?;
        let report = FrameReport {
            produced: streamed.produced,
            evicted: streamed.evicted,
            terrain_quads: streamed.draws.camera.1,
            seed_quads: self.world.forest.as_ref().map_or(0, |f| f.seeds.visible),
            ..FrameReport::default()
        };
        Ok(Ticket { flight, reads, view: streamed.view, began, record_ns, report })
    }

    /// Waits for a frame and completes its report.
    fn complete(&self, ticket: Ticket) -> Result<(FrameReport, View)> {
        let Ticket { flight, reads, view, began, record_ns, report } = ticket;
        let done = info_span!("wait").in_scope(|| flight.wait())?;
        if let Some(state) = &reads.tiles {
            TreeTiles::check(&done.get(state)[0])?;
        }
        if let Some(draws) = &reads.meshes {
            Meshes::check(&done.get(draws))?;
        }
        let trees = reads.counts(&done);
        if let Some((_, cull)) = self.world.near() {
            cull.check(trees.camera)?;
        }
        Ok((report.complete(&began, record_ns, done, trees), view))
    }

    /// Reads the last frame back, when it is done: the display picture, and with layers the linear image.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if the device fails.
    pub fn picture(&self) -> Result<Picture> {
        let _read = info_span!("read back").entered();
        self.canvas.targets.read(&self.gpu, &self.plan, self.light.scale)
    }

    /// The shadow cascades of an eye.
    pub fn cascades(&self, eye: &Eye) -> Vec<Cascade> {
        let highest = self.world.terrain.tree.total_range()[1] + self.plan.tallest;
        Shadows::cascades(&self.scene, &self.plan, &seen_by(eye, &self.plan), self.light.direction, highest)
    }

    /// Puts the sun elsewhere, or gives it another irradiance.
    ///
    /// # Errors
    /// [`Error::Usage`] when it shines and the plan was made without.
    pub fn set_sun(&mut self, sun: Sun) -> Result<()> {
        if !self.plan.sun && sun.shines() {
            return Err(Error::Usage("the plan was made without a sun: plan again for this one".into()));
        }
        Arc::make_mut(&mut self.scene).sun = sun;
        self.light = Light::new(&self.scene);
        Ok(())
    }

    /// Draws the scene as it is at a time from now on, s: any finite number. Only what the wind moves changes with it.
    pub fn set_time(&mut self, seconds: f64) {
        self.time = if seconds.is_finite() { seconds } else { 0.0 };
    }

    /// The scene that is drawn.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The plan that is drawn.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The ground: its quadtree and its tiles.
    pub fn terrain(&self) -> &TerrainData {
        &self.world.terrain
    }

    /// What lives between frames for the trees.
    pub fn forest(&self) -> Option<&Forest> {
        self.world.forest.as_ref()
    }

    /// The shadow maps.
    pub fn shadows(&self) -> &Shadows {
        &self.world.shadows
    }

    /// What finds the trees that cast shadows.
    pub fn casters(&self) -> Option<&CasterData> {
        self.world.casters()
    }

    /// The device that draws.
    pub fn gpu(&self) -> &Gpu {
        &self.gpu
    }
}
