//! Captures of single frames through RenderDoc's in-application interface, when the program runs under it.

use renderdoc::{RenderDoc, V110};

use crate::{Error, Result};

/// RenderDoc, attached to this process.
pub struct FrameCapture {
    api: RenderDoc<V110>,
}

impl FrameCapture {
    /// The RenderDoc that this process runs under.
    ///
    /// # Errors
    /// [`Error::Usage`] if it runs under none.
    pub fn attached() -> Result<Self> {
        let api = RenderDoc::new().map_err(|e| {
            Error::Usage(format!(
                "no RenderDoc is attached ({e}): start canopy from it, with `renderdoccmd capture canopy …`, or with \
                 ENABLE_VULKAN_RENDERDOC_CAPTURE=1 where its layer is installed"
            ))
        })?;
        Ok(FrameCapture { api })
    }

    /// Captures what the device does meanwhile.
    pub fn around<T>(&mut self, work: impl FnOnce() -> T) -> T {
        // Null: the one device that there is.
        self.api.start_frame_capture(std::ptr::null(), std::ptr::null());
        let done = work();
        self.api.end_frame_capture(std::ptr::null(), std::ptr::null());
        done
    }

    /// Files of all captures so far.
    pub fn files(&self) -> Vec<std::path::PathBuf> {
        (0..self.api.get_num_captures())
            .filter_map(|k| self.api.get_capture(k))
            .map(|(path, _)| path)
            .collect()
    }
}
