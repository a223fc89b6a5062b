// Which tile of the picture a workgroup has.

// Its first pixel. Workgroups count down the picture first: a driver that runs them on CPU threads gives each thread a range of them,
// and the left of a picture takes about as long as its right, which is not so of its sky and what lies near below.
uvec2 tile_corner() { return gl_WorkGroupID.yx * TILE_SIDE; }
