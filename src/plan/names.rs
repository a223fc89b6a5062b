//! Every name that a plan and what it plans have in common, once: of passes, of pipelines, and of buffers and images.

/// Passes, as reports name them.
pub mod pass {
    /// Heights and slopes of new quads of terrain.
    pub const TERRAIN_TILES: &str = "terrain tiles";
    /// New quads of trees.
    pub const SEEDS: &str = "seeds";
    /// New quads of terrain with trees.
    pub const COVERAGE: &str = "coverage tiles";
    /// Which trees are seen.
    pub const CULL: &str = "cull";
    /// How many of them are before each group.
    pub const SUMS: &str = "prefix sums";
    /// How many each draw has.
    pub const COMMANDS: &str = "draw commands";
    /// Their records, in order.
    pub const COMPACT: &str = "compact";
    /// Which trees cast shadows.
    pub const CASTERS: &str = "casters";
    /// Shadow maps.
    pub const SHADOWS: &str = "shadows";
    /// A sky that is an image.
    pub const SKY: &str = "sky";
    /// Which of the trees in view are meshes.
    pub const MESH_LISTS: &str = "mesh lists";
    /// Meshes: which triangle each sample sees.
    pub const MESHES: &str = "meshes";
    /// Light on meshes.
    pub const MESH_LIGHT: &str = "mesh light";
    /// Which of the trees in view are clouds of cards.
    pub const CARD_LISTS: &str = "card lists";
    /// Cards: which of them each sample sees.
    pub const CARDS: &str = "cards";
    /// Light on cards.
    pub const CARD_LIGHT: &str = "card light";
    /// Shells: which slice each sample sees.
    pub const SHELLS: &str = "shells";
    /// Light on shells.
    pub const SHELL_LIGHT: &str = "shell light";
    /// Trees far away, and average light.
    pub const SHADER_MAP: &str = "shader-map";
    /// The ground.
    pub const TERRAIN: &str = "terrain";
    /// Tiles: trees front to back.
    pub const TREE_ORDER: &str = "tree order";
    /// Tiles: a record a tree.
    pub const TREE_SIGHTS: &str = "tree sights";
    /// Tiles: no entries yet.
    pub const LIST_COUNTS: &str = "list counts";
    /// Tiles: trees of each square of pixels.
    pub const TILE_LISTS: &str = "tile lists";
    /// Tiles: the tree that each sample sees.
    pub const TILES: &str = "tiles";
    /// Tiles: the sky, and far trees before it.
    pub const HORIZON: &str = "horizon";
    /// Tiles: light on the ground.
    pub const GROUND: &str = "ground";
    /// Tiles: light on trees.
    pub const TREE_LIGHT: &str = "tree light";
    /// The graphics pipeline: trees.
    pub const TREES: &str = "trees";
    /// Sums of the frames whose mean a picture is.
    pub const ACCUMULATION: &str = "accumulation";
    /// The picture for display.
    pub const TONE_MAP: &str = "tone map";
}

/// Pipelines, as plans name them; in captures they have their last shader's name.
pub mod pipeline {
    /// Near trees of the graphics pipeline.
    pub const MAGNIFIED: &str = "trees magnified";
    /// Trees of many pixels.
    pub const TREES: &str = "trees";
    /// Trees of few pixels.
    pub const SMALL: &str = "trees small";
    /// Trees whose light is the average.
    pub const CONVERGED: &str = "trees converged";
    /// Tiles: trees front to back.
    pub const TREE_ORDER: &str = "tree order";
    /// Tiles: a record a tree.
    pub const TREE_SIGHTS: &str = "tree sights";
    /// Tiles: trees of each square of pixels.
    pub const TILE_LISTS: &str = "tile lists";
    /// Tiles: the tree that each sample sees.
    pub const TILES: &str = "tiles";
    /// Tiles: light on trees.
    pub const TREE_LIGHT: &str = "tree light";
    /// Tiles: prefix sums.
    pub const TILE_SUMS: &str = "tile sums";
    /// Tiles: the sky, and far trees before it.
    pub const HORIZON: &str = "horizon";
    /// Tiles: light on the ground.
    pub const GROUND: &str = "ground";
    /// Which of the trees in view are meshes.
    pub const MESH_LISTS: &str = "mesh lists";
    /// Meshes: which triangle each sample sees.
    pub const MESHES: &str = "meshes";
    /// Light on meshes.
    pub const MESH_LIGHT: &str = "mesh light";
    /// Which of the trees in view are clouds of cards.
    pub const CARD_LISTS: &str = "card lists";
    /// Cards: which of them each sample sees.
    pub const CARDS: &str = "cards";
    /// Light on cards.
    pub const CARD_LIGHT: &str = "card light";
    /// Shells: which slice each sample sees.
    pub const SHELLS: &str = "shells";
    /// Light on shells.
    pub const SHELL_LIGHT: &str = "shell light";
    /// What of all trees' pipelines sways them.
    pub const SWAY: &str = "sway of trees";
    /// What of meshes' pipelines moves their leaves.
    pub const FLUTTER: &str = "flutter of leaves";
    /// What of the ground's pipelines moves the shader-map.
    pub const GUSTS: &str = "gusts over the shader-map";
    /// What of shells' pipelines moves them.
    pub const GUSTS_OF_SHELLS: &str = "gusts over shells";
    /// What of a tree's pipelines finds where the sun enters.
    pub const LIGHT_RAY: &str = "light ray of trees";
}

/// Buffers and images, as captures and memory reports name them.
pub mod resource {
    /// Heights of the terrain.
    pub const HEIGHT_MAP: &str = "height map";
    /// Reflectance of the ground.
    pub const ALBEDO: &str = "ground albedo";
    /// Sky.
    pub const SKY: &str = "sky image";
    /// Heights of quads of terrain.
    pub const HEIGHT_TILES: &str = "height tiles";
    /// Slopes of quads of terrain.
    pub const SLOPE_TILES: &str = "slope tiles";
    /// z-field views of all species.
    pub const VIEWS: &str = "z-field views";
    /// Outlines of the views of all species.
    pub const OUTLINES: &str = "view outlines";
    /// A band of light transfer of all species.
    pub const TRANSFER: &str = "light transfer";
    /// Pair tables of all species.
    pub const PAIR_TABLES: &str = "pair tables";
    /// View tables of all species.
    pub const VIEW_TABLES: &str = "view tables";
    /// What leaves, bark and ground hand to each other of light, by density.
    pub const INDIRECT: &str = "indirect light";
    /// The same of each tree in view.
    pub const HANDED: &str = "handed light";
    /// Corners of the meshes' triangles.
    pub const MESH_CORNERS: &str = "mesh corners";
    /// What the meshes' triangles are.
    pub const MESH_FACES: &str = "mesh faces";
    /// Crowns around the leaves of meshes.
    pub const ENVELOPES: &str = "leaf envelopes";
    /// How light comes to the faces of meshes.
    pub const FACE_TRANSFERS: &str = "face transfers";
    /// What trees hide of the sky from leaves of neighbours.
    pub const HIDING: &str = "hidden sky";
    /// Where the meshes' materials are holes.
    pub const LEAF_MASKS: &str = "leaf masks";
    /// Indices of the meshes' triangles, in the orders in which they are drawn.
    pub const MESH_INDICES: &str = "mesh indices";
    /// Where each species' mesh is, and its levels of detail.
    pub const MESH_KINDS: &str = "mesh kinds";
    /// Draws of the trees that are meshes.
    pub const MESH_DRAWS: &str = "mesh draws";
    /// Trees in view that are meshes.
    pub const MESH_TREES: &str = "mesh trees";
    /// Cards of all species' clouds.
    pub const CARDS: &str = "cards";
    /// Which cards are which species'.
    pub const CARD_KINDS: &str = "card kinds";
    /// Draws of the trees that are clouds of cards.
    pub const CARD_DRAWS: &str = "card draws";
    /// Opacity of cards.
    pub const CARD_OPACITIES: &str = "card opacities";
    /// What is painted on cards.
    pub const CARD_SURFACES: &str = "card surfaces";
    /// Light transfer of what is painted on cards.
    pub const CARD_TRANSFERS: &str = "card transfers";
    /// What shells are of, and where.
    pub const SHELL_TABLE: &str = "shell table";
    /// Cover of shells by trees.
    pub const SHELL_COVERS: &str = "shell covers";
    /// Reflectance of shells, and share of leaves.
    pub const SHELL_REFLECTANCES: &str = "shell reflectances";
    /// Transmittance of shells, and height.
    pub const SHELL_TRANSMITTANCES: &str = "shell transmittances";
    /// How light comes to shells.
    pub const SHELL_LIGHTS: &str = "shell lights";
    /// What the forest leaves of the sky.
    pub const FOREST_SKY: &str = "forest sky";
    /// Density maps.
    pub const DENSITY_MAPS: &str = "density maps";
    /// The point pattern.
    pub const PATTERN: &str = "point pattern";
    /// Seeds.
    pub const SEEDS: &str = "seeds";
    /// Coverage tiles.
    pub const COVERAGE: &str = "coverage tiles";
    /// Sums from which coverage tiles are made.
    pub const COVERAGE_SUMS: &str = "coverage sums";
    /// Trees in view.
    pub const TREES: &str = "trees";
    /// The same by bins of distance.
    pub const TREE_LISTS: &str = "tree lists";
    /// Indices of the quads that show trees.
    pub const QUAD_INDICES: &str = "quad indices";
    /// What the cull found of each seed.
    pub const SEED_CLASSES: &str = "seed classes";
    /// How many of each group are in each list.
    pub const LIST_COUNTS: &str = "list counts";
    /// Trees that cast shadows.
    pub const CASTERS: &str = "casters";
    /// Nodes of the shader-map.
    pub const NODES: &str = "shader-map nodes";
    /// Shadow maps.
    pub const CASCADES: &str = "shadow cascades";
    /// Depth of the picture.
    pub const DEPTH: &str = "depth";
    /// Sums of the frames whose mean a picture is.
    pub const SUMS_OF_FRAMES: &str = "sums of frames";
    /// Picture for display.
    pub const PICTURE: &str = "picture";
    /// Quad of terrain that each sample sees.
    pub const QUADS_SEEN: &str = "quads seen";
    /// Depth of each pixel's first sample.
    pub const FIRST_DEPTH: &str = "first depth";
}
