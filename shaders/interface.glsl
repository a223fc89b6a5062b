// What host and shaders share, defined once: build.rs writes the Rust side of every struct and constant.

const uint MAX_SPECIES = 8u;          // most species in a scene
const uint MAX_CASCADES = 4u;         // most shadow cascades
const uint DISTANCE_BINS = 32u;       // bins of the camera's list of trees, front to back
const uint TREE_LISTS = 33u;          // lists that a seed can be in: all, one of the bins
const uint CAMERA_DRAWS = 4u;          // draws of the camera's list: near, middle, far and converged bins
const uint CULL_GROUP = 256u;         // seeds a workgroup of the cull
const uint SHADOW_PAGES = 64u;        // pages along a side of a shadow cascade: what is kept, and what is drawn at once
const float SHADOW_DEPTHS = 16.0;     // depth range of a cascade over its width
const uint SHADOW_CELLS = 8u;         // mesh cells along a side of a square of ground that casts
const uint TERRAIN_CELLS = 32u;       // mesh cells along a side of a terrain quad
const float SHELL_ROOM = 0.75;         // part of the distance from which on there are slices from which on they are looked for: a mesh cell spans less
const uint SHELL_CELLS = 8u;          // mesh cells along a side of a slice of forest over a terrain quad
const uint TERRAIN_HEIGHTS = 33u;     // height samples along a side of a terrain tile
const uint FOREST_NODES = 17u;        // shader-map nodes along a side of a terrain quad: every second vertex
const uint TERRAIN_SLOPES = 65u;      // slope samples along a side of a terrain tile
const uint NO_PAGE = 0xffffffffu;     // no layer of a texture array
const uint COVER_GUTTER = 8u;         // texels around a coverage tile's quad on each side: one of mip 3
const uint COVER_LEVELS = 4u;         // mip levels of a coverage tile
const uint COVER_GROUPS = 3u;         // most layers of a tile: its coverage and a channel a species, four a layer
const uint ORDER_LANES = 128u;        // invocations that sort trees by depth, each a part of the list without gaps
const uint DEPTH_BINS = 768u;         // bins of that sort: 32 an octave, from 1/64 m on
const uint SCAN_BLOCK = 2048u;        // counts of which a workgroup makes prefix sums
const uint TILE_SIDE = 8u;            // pixels along a side of a tile
const uint SIGHT_TEXELS = 8u;         // 16-byte words of a tree's record for finding its visible samples
const uint MESH_TREES = 4096u;        // most trees in view that are meshes: 12 bits of what a sample sees
const uint MESH_TRIANGLES = 524288u;  // most triangles of a mesh: 19 bits of it
const uint HIDING_STEPS = 16u;        // steps of height above the ground for which what trees hide of the sky is known
const uint TREE_SPECIES = 15u;        // of a tree's word of species: its index; the rest is its sway in the wind (physics/wind.glsl), in its own axes
const uint MESH_SEEN = 0x80000000u;   // of what a sample sees: a mesh's tree << 19 | triangle, not a quad of the ground
const uint CARD_SEEN = 0x40000000u;   // of what a sample sees, where it is no mesh: a tree << 9 | card of its cloud
const uint SHELL_SEEN = 0x20000000u;  // of what a sample sees, where it is neither: a quad of the ground << 6 | slice over it
const uint CARD_TREES = 2097152u;     // most trees in view, where some are clouds of cards: 21 bits of it
const uint MOST_CARDS = 512u;         // most cards of a cloud with its far form: 9 bits of it
const uint FAR_CARDS = 3u;            // cards of the far form of a cloud
const uint CARD_LEVELS = 4u;          // levels of detail of pictures of cards
const uint SKY_STEPS = 16u;           // steps of the height, and of the thickness of crowns around, for which the sky of a forest is known
const float TRANSFER_SCALE = 1.024;    // of coefficients of light transfer as they are stored, -1 to 1
const float FREE_SCALE = 7.0344262;       // of coefficients of what other trees leave of a direction, as shells store them, -1 to 1
const uint OPTICS = 27u;              // vectors a species: reflectance and transmittance of leaves, bark; of each of two forms twelve of what harmonics leave out of the sun
const uint LEAF_OCTAVES = 7u;         // shares of the leaves at which the pull on their cards is known: 1, 1/2, 1/4 and so on
const float LEAST_SHARE = 0.015625;   // the last of them
const float FADE_BAND = 0.1;          // half the width of the band of ranks in which cards fade, over u (1 - u)
const uint BARK_LEVELS = 6u;          // most levels of bark, the whole among them
const float BARK_PIXELS = 0.5;        // farthest that a drawn level may be from the whole bark, pixels
const uint MESH_DRAWS = 2u;           // draws of a tree that is a mesh: all of it or its leaves; its bark
const uint COVER_SCRATCH = 16u;       // coverage tiles of one scratch word a texel that the scratch buffer holds
const float FADE_FIRST = 0.9;         // part of its range at which the first of a species' trees has faded out
const float FADE_SPREAD = 0.1;        // and how much later the last has, each at a time of its own
const float FADE_RATE = 10.0;         // opacity that a tree loses per part of the range while it fades
const float HANDOVER_FROM = 0.8;      // part of the range from which on the shader-map shows trees: where the first one begins to fade
const float HANDOVER_RATE = 5.0;      // 1 over the width of the band, in which all of them fade

// Everything of a frame that does not depend on the object drawn. World positions are relative to the camera. Bound as
// a uniform block: arrays are of vec4 and mat4 only, so that std140 and std430 agree.
struct View {
    mat4 clip_from_world;             // reverse Z, infinite far
    mat4 cascade_from_world[4];       // xy in [-1, 1]; z in [0, 1], 1 at the sun's side
    vec4 planes[6];                   // of the view frustum: dot(xyz, p) + w >= 0 inside
    vec4 cascade_turn[4];             // xy: texel of the map where the cascade's first texel is; those beyond the end begin anew
    vec4 cascade_texel;               // metres a texel of each cascade
    vec4 cascade_far;                 // distance to which each cascade is used, m
    vec4 bins[8];                     // squared upper distances of the distance bins
    vec3 sun_direction;               // unit, towards the sun
    uint cascade_count;               // 0: no sun
    uint mesh_cascades;               // of these, the first ones into which meshes cast: single leaves are told apart there
    vec3 cascade_x;                   // unit, axis x of all cascades
    vec3 cascade_y;                   // unit, axis y
    vec3 sun_irradiance;              // on a plane facing the sun, times the exposure scale
    float pixels_at_1m;               // pixels that one metre covers at one metre
    vec3 sky_radiance;                // mean over the upper hemisphere, times the exposure scale
    float camera_height;              // z of the camera in the terrain's system, m
    float footprint;                  // log2 of the pixel's size over the distance between pixels: 0 but for sparse images
    ivec2 grid_camera;                // camera's cell of the terrain's finest grid
    vec2 grid_offset;                 // camera's position in that cell, m
    vec2 quad_offset;                 // camera's position in that quad, m
    ivec2 wang_camera;                // Wang tile that the camera is over
    vec2 wang_offset;                 // camera's position in it, in tile sides
    vec2 shift;                       // by which the picture is shifted, in clip space: its pixels are means of frames with several shifts
    uint dither_turn;                 // what such a frame adds to the dithers of trees, 2^-32
    uint frames_before;               // such frames of the same picture
    float hotspot_amplitude;          // a1 of BN12 eq. 8
    float hotspot_width;              // a2 of BN12 eq. 8, 1/rad
    float ground_contrast;            // a3 of BN12 eq. 10
    float convergence;                // distance over the range from which light is the average, BN12 eq. 22-25; less than 0: that of the ground alone; 0: it never is
    float silhouette_ratio;           // range of trees on silhouettes over that of others: 1 without relief
    float silhouette_step;            // first distance from a tree at which its sight line is compared with the ground, m
    float height_cell;                // metres a texel of the height map
    float cells_per_metre;            // 1 / height_cell
    vec4 wind;                        // xy: unit vector to where it blows; amplitudes of the shear: z by gusts, w of a tree's own
    vec4 wind_waves;                  // xyz: phases of the gusts' waves at the world's origin, turns; w: amplitude of leaves, rad
    vec4 wind_here;                   // xyz: the same at the camera; w: amplitude of branches
    uint wind_clock;                  // part of the wind's period that has passed, 2^-32
};

// One species. Bound as a uniform block: without arrays, and with a vec3 in it, std140 and std430 agree.
struct Species {
    vec3 scale_to_metres;             // S: half extents of the tree box, m
    float centre;                     // height of the box's centre o above the trunk base, m
    vec3 reflectance;                 // of the crown's leaves and twigs, at phase angle 0
    float extinction;                 // tau of the crown's self-shadow, 1/(m rad)
    vec3 transmittance;               // of the crown's leaves
    float mesh_range;                 // distance to which trees are their model's mesh, times their scale, m; 0: none is
    float range;                      // s_max: distance to which trees are drawn one by one, m; 0: none is
    float crown_radius;               // sqrt(A / pi), m
    float bounding_radius;            // of a sphere about o, m
    uint first_layer;                 // of its views in the z-field array
    vec2 scale_range;                 // smallest and largest random scale
    float max_density;                // trees per m2 where its map is 1
    uint density_layer;               // of its map in the density array; NO_PAGE: 1 everywhere
    vec2 between_heights;             // smooth limits on the ground's height, m
    float below_slope;                // smooth limit on the slope, as a tangent
    float height_softness;            // width of the smooth height limits, m
    vec2 map_size;                    // texels of its density map in use
    float slope_softness;             // width of the smooth slope limit, as a tangent
    float bare_below;                 // height in scaled tree space under which there is only bark
    vec3 bark_ratio;                  // reflectance of bark over albedo of leaves
    float mean_area;                  // A: mean horizontal area of its trees, m2
    float vertical_scale;             // of the space in which its tables are, BN12 eq. 2-6
    float max_thickness;              // density times area at the tables' last density
    float listed_density;             // listed trees per m2 where its map is 1; 0: not listed
    float leaf_shadow;                // c of the crown's self-shadow, 1/sqrt(rad)
    vec3 albedo;                      // of what is seen of a crown, for the sky's light
    float turning;                    // change of the reflectance with the phase angle, 1/rad
    float sky_path;                   // mean optical path of the sky's light through single crowns, a unit of thickness
    float hole;                       // 1 / squared radius of the hole around a tree, over the density: BN12 eq. 9
    float card_range;                 // distance to which trees are clouds of cards at most, times their scale, m; 0: none is
    vec4 lit[4];                      // correction of the share of a crown that is lit: two at the middle of the tree, two of their change
    vec4 sent[4];                     // correction of the sunlight that it sends
};

// Rows of the projection of scaled tree space into one z-field view.
struct ViewBasis {
    vec4 u;                           // texture u - 0.5 = dot(u, p)
    vec4 v;                           // texture v - 0.5 = dot(v, p)
    vec4 depth;                       // depth towards the viewer = dot(depth, p)
    vec4 bounds;                      // of what the view shows: least and greatest p.right, then p.up
};

// One tree, as produced for a seed quad.
struct Seed {
    vec2 position;                    // from the quad's south-west corner, m
    float ground;                     // height of the ground there, m
    float scale;                      // of the model
    uint turn_tint;                   // low half: rotation in 1/65536 turn; high half: tint
    uint identity;                    // hash from which the tree's other random numbers come
    uint slope;                       // two halves: derivatives of the ground's height east and north
    uint species_density;             // low half: index; high half, half float: square root of the density at which trees of it would cover what all trees here do
};

// A seed quad with a region of seeds.
struct SeedQuad {
    ivec2 tile;                       // index of its south-west Wang tile
    ivec2 texel;                      // height map texel of its south-west corner
    vec2 texel_offset;                // and the position in that texel
    vec2 corner;                      // south-west corner from the camera's quad, m; set for culling
    uint region;                      // its region in the seed buffer
    uint first_position;              // its listed trees
    uint position_count;              // and their number
    uint wind_phases;                 // that gusts have at its corner, of 1/1024 turn, ten bits a wave; 0 without wind
};

// A listed tree, binned to its quad.
struct ListedTree {
    vec2 position;                    // from the quad's south-west corner, m
    float scale;                      // 0: drawn from the species' range
    float turn;                       // rotation in turns; negative: drawn
    uint species;                     // index
    uint index;                       // in its list
};

// What producing seeds takes, besides the quads.
struct SeedParameters {
    vec2 extent;                      // of the terrain, m
    float quad_side;                  // side of a seed quad, m
    float tile_side;                  // side of a Wang tile, m
    float cell_size;                  // metres a height map texel
    float pattern_density;            // points of the pattern per m2
    uint seed;                        // of the scene
    uint region_capacity;             // seeds a region
    uint tiles_per_side;              // Wang tiles along a quad; 0: no pattern
    uint points_per_tile;             // slots of a Wang tile in the pattern buffer
    uint first_quad;                  // of this dispatch
    uint has_heights;                 // 0: a level plain
};

// A point of a Wang tile pattern.
struct PatternPoint {
    vec2 position;                    // in [0, 1) of the tile's side; x negative: unused slot
};

// A tree that is seen by the camera, with what drawing it takes.
struct Tree {
    vec3 centre;                      // of its box, from the camera, m
    float scale;                      // of the model
    vec2 turn;                        // cosine and sine of its rotation
    uint species;                     // index; sway in the wind << 4
    uint identity;                    // hash
    uint view_layers;                 // three z-field views nearest the view direction, 10 bits each; bit 31: from below
    uint light_layers;                // the same for the light direction
    vec2 view_weights;                // of the first two views
    vec2 light_weights;               // of the first two light views
    float mip;                        // of the views
    float fade;                       // factor of the opacity
    vec3 sun;                         // radiance of a lit leaf at height 0: phase function, hotspot, irradiance and correction
    uint hole_change;                 // halves: 1 / squared radius of the hole around it, 1/m2; change of `sun` with the height, over it
    vec3 sky;                         // radiance of a leaf under the whole sky
    uint cascade_tint;                // cascade for its shadow lookups | samples in which it is its mesh << 8 | its mesh or its cards << 12 | tint as a half << 16
    vec3 mean_sun;                    // average radiance from the sun, times nu of BN12 eq. 22
    uint own_lit;                     // halves: 1 - nu, weight of the tree's own light; correction of its lit share at height 0
    vec3 mean_sky;                    // average radiance from the sky, times nu
    uint mean_lit_change;             // halves: average k_t / (k_t + k_t-bar), times nu; change of that correction with the height
};

// Of a tree that is seen by the camera: what the forest hands to it of light.
struct HandedLight {
    uvec2 sun;                        // light that met more than one surface, of the sun: colour, and profile by height
    uvec2 sky;                        // of the sky
    uvec2 open;                       // halves, at four heights: what there is of the sky's light over what its z-field knows
    uvec2 spare;                      // a texel has four words
};

// What of a cascade lies between two seams of its map, and how the world is drawn there. Its coordinates are world-fixed: x and
// y texels of the map, z depth. Also the push constants of the draws.
struct ShadowBlock {
    vec3 x;                           // axis x, texels a metre
    uint cascade;                     // layer of the map
    vec3 y;                           // axis y, texels a metre
    float to_clip;                    // 2 / texels along the map
    vec3 z;                           // towards the sun, depth a metre
    float ground;                     // height to which the corners of quads refer, m
    ivec2 first;                      // first page drawn
    ivec2 last;                       // first page beyond
    int sums;                         // of its page (0, 0) in the table of sums
    float texels_per_metre;           // of the map
    float pages_per_texel;            // 1 / texels along a page
    float depth_per_metre;            // length of z
};

// A seed quad whose trees may cast into what is drawn of a block.
struct CasterQuad {
    vec3 corner;                      // of its south-west corner in the block, at the block's ground
    uint region;                      // its region in the seed buffer
    uint block;                       // index
    uint base;                        // first record of the block
    uint wind_phases;                 // as in SeedQuad
};

// A species' model as a mesh: where its triangles and their indices are, and what is drawn of them at which size (physics/levels.glsl).
struct MeshKind {
    vec3 half_box;                    // half extents of the tree's box, m
    float card_side;                  // of a square of a leaf card's mean area, m
    uint tree_count;                  // trees in view that are meshes: each frame's
    uint first_face;                  // of all meshes' triangles
    uint face_count;                  // triangles of the whole model, in their own order
    uint first_name;                  // of its triangles' random numbers, which levels have no part in
    uint first_whole;                 // of all meshes' indices: those of the whole model
    uint first_leaf;                  // leaves in the shuffled order of their cards
    uint leaf_count;                  // triangles of them
    uint bark_levels;                 // levels of bark, the whole first
    vec3 leaf_middle;                 // of all leaves, m from the middle of the box
    float pull[LEAF_OCTAVES];         // factor of how far cards are from there, at shares of 1, 1/2, 1/4 and so on
    uint first_bark[BARK_LEVELS];     // indices of each level
    uint bark_count[BARK_LEVELS];     // triangles of it
    float bark_error[BARK_LEVELS];    // how far it is from the whole bark, m
};

// A tree that is a mesh, and what of it is drawn.
struct MeshTree {
    uint tree;                        // of the trees in view
    float share;                      // of its leaves
    float pull;                       // factor of how far their cards are from the middle of all
    uint bark;                        // level
};

// What finding the trees that are meshes takes.
struct MeshParameters {
    uint bins;                        // distance bins that can have some
    uint species_count;               // of the scene
    float leaf_pixels;                // least side of a card on the screen; 0: meshes are always whole
    uint named;                       // 1: draws name their trees; 0: whoever records them does
};

// A card of a cloud, m from the middle of the tree's box, and its pictures in the atlas of its species.
struct Card {
    vec3 centre;                      // its middle
    float depth;                      // half depth of what is painted on it, m
    vec3 right;                       // from there to the middle of its right edge
    uint front;                       // upper left texel of the picture of its front: x | y << 16
    vec3 up;                          // and of its upper edge
    uint back;                        // the same of its back
    uint size;                        // of either picture, texels: width | height << 16
};

// A species' cloud of cards.
struct CardKind {
    uint first_card;                  // of all cards
    uint full_count;                  // cards of the full cloud, behind which are those of its far form
    uint far_count;                   // cards of that
    uint tree_count;                  // trees in view that are cards: each frame's
};

// What finding and drawing the trees that are clouds of cards takes.
struct CardParameters {
    uint tree_capacity;               // trees that fit
    uint species_count;               // of the scene
    uint cloud_bins;                  // distance bins in which trees can be full clouds
    uint far_bins;                    // first distance bin in which one can be its far form
    uint card_bins;                   // distance bins in which trees can be cards
    uint cloud_cards;                 // of the largest full cloud
    float fade_pixels;                // apparent height of a tree from which on its full cloud gives way to the far form
    uint far_form;                    // 1: what is drawn is the far form
};

// Shell textures of the scene's forest. Bound as a uniform block.
struct ShellTable {
    vec4 shares[3];                   // of what channels of coverage tiles are: the share of the full density of trees, a unit
    vec4 nearness[3];                 // and 1 over the range of single trees of that species, 1/m; 0 where none is drawn by itself
    vec4 sun[10];                     // what texels leave out of the sun on the side that is seen, and on the other one: src/bake/shells/sun.rs
    vec3 reflectance;                 // largest, that texels of 1 have
    float height;                     // of the stack, m
    vec3 transmittance;               // largest
    float tile_side;                  // of a Wang tile, m
    float begin;                      // distance from which on some trees are slices, m
    float spread;                     // apparent height of a slice under which slices merge, pixels
    uint slices;                      // of the finest stack
    uint texels;                      // along a side of a tile
    uint seed;                        // of the scene
};

// What lighting shells takes.
struct ShellLightParameters {
    uvec2 size;                       // of the image, pixels
    float step;                       // metres a finest grid step of the terrain
    float larger;                     // log2 of how much larger texels of light are than those of cover
};

// What lighting cards takes.
struct CardLightParameters {
    uvec2 size;                       // of the image, pixels
    vec2 top;                         // height to which what trees hide of the sky is known, m; 1 over it
};

// What lighting meshes takes.
struct MeshLightParameters {
    uvec2 size;                       // of the image, pixels
    vec2 heights;                     // to which what trees hide of the sky is known, m; steps of it a metre
};

// A triangle of a mesh.
struct MeshFace {
    uint mask;                        // layer of the array of masks; NO_PAGE: no holes
    uint foliage;                     // bit 0: a leaf, else bark; bit 1: it turns in the wind, about an axis of two bytes << 16
    float rank;                       // of its card of leaves in their shuffled order: share of their area before the card's middle
    uint middle;                      // of the card, or of the leaf that turns, in the tree's box, 10 bits an axis
};

// A tree that casts.
struct Caster {
    vec3 place;                       // of its box's centre in the block
    float scale;                      // of the model
    vec2 turn;                        // cosine and sine of its rotation
    uint species;                     // index; sway in the wind << 4
    uint light_layers;                // three z-field views nearest the light direction, 10 bits each
    vec2 light_weights;               // of the first two views
    float mip;                        // of the views
    uint dither;                      // hash; its last 8 bits: the tree's name in the map
};

// A draw of vertices without indices.
struct PlainDraw {
    uint vertex_count;                // vertices
    uint instance_count;              // instances
    uint first_vertex;                // first vertex
    uint first_instance;              // first instance
};

// What finding casters takes.
struct CasterParameters {
    uint first_quad;                  // of this dispatch
    uint groups_per_region;           // workgroups a region
    uint region_capacity;             // seeds a region
    uint first_command;               // of this dispatch: one a block
};

// A square of ground that casts into a block.
struct GroundCaster {
    vec4 corners[4];                  // in the block, at its ground: south-west, south-east, north-west, north-east
    ivec2 corner;                     // south-west corner on the terrain's finest grid
    int spacing;                      // finest grid steps a mesh cell
};

// An indexed indirect draw.
struct DrawCommand {
    uint index_count;                 // indices
    uint instance_count;              // instances
    uint first_index;                 // first index
    int vertex_offset;                // added to each index
    uint first_instance;              // first instance
};

// What culling takes.
struct CullParameters {
    uint group_count;                 // workgroups
    uint groups_per_region;           // workgroups a region
    uint region_capacity;             // seeds a region
    uint tree_capacity;               // trees that fit
    uint near_bins;                   // distance bins of the camera's first draw
    uint far_bins;                    // first distance bin of its third
    uint converged_bins;              // first distance bin of its last
};

// What the tile rasteriser takes.
struct TileParameters {
    uvec2 size;                       // of the image, pixels
    uvec2 lists;                      // of tiles along a row and down a column
    uint list_shift;                  // log2 of the pixels along a side of the tiles that share a list
    float near;                       // distance of the near plane, m
    uint step_capacity;               // steps of writing the lists: trees, and entries that all lists together hold
    uint list_lanes;                  // invocations that write them, each a part of all steps without gaps
};

// What of a frame's trees the tiles' passes find on their way.
struct TileState {
    uint tree_count;                  // trees in view
    uint step_count;                  // trees, and entries of all lists
    uint whole;                       // 1: they are more than fit, and each tile looks at all trees
    uint overrun;                     // 1: a tile took more turns than drivers allow, and its picture is not complete
    uvec3 tree_groups;                // workgroups of a dispatch over all trees
};

// One terrain quad to draw.
struct TerrainQuad {
    ivec2 corner;                     // south-west corner on the terrain's finest grid
    int spacing;                      // finest grid steps a mesh cell
    uint layer;                       // of its tiles
    vec2 morph;                       // distances at which vertices begin and end to morph to the next level, m
    vec2 cover_offset;                // texture coordinates of its south-west corner in its coverage tile
    float cover_scale;                // and how much of them the quad's side spans
    uint cover_layer;                 // first layer of its coverage tile; NO_PAGE: no trees
    float cover_disc;                 // log2 of the mean disc area in texels of that tile
    float cover_floor;                // 1: the tile is the quad's own, and fades to its mip 1 where the quad morphs
};

// The shader-map at a node of a terrain quad's grid: what depends on directions and slope, per optical thickness of the
// crowns from above (sum of density times mean area), which the pixel knows better.
struct ForestNode {
    vec3 tree_sun;                    // radiance of the shader-map's trees from the sun
    float tree_lit;                   // k_t / (k_t + k_t-bar)
    vec3 tree_sky;                    // their radiance from the sky
    float converged;                  // nu of BN12 eq. 24 and 25
    float over;                       // path through the crowns of trees that the shader-map shows, over the thickness
    float seen;                       // path through all crowns towards the viewer, over the thickness
    float joint;                      // path towards viewer and sun
    float seen_coverage;              // mean coverage by discs where ground is seen
    float sky;                        // -ln D over the thickness
    float gap;                        // -ln(1 - C) over the thickness
    float middle;                     // height above the ground of the middle of crowns, m
    float half_depth;                 // from there to their upper end, m
};

// What the terrain takes.
struct TerrainParameters {
    vec2 last;                        // north-east corner of the terrain on the finest grid (not always whole)
    float step;                       // metres a finest grid step
    float texels_per_step;            // height map texels a finest grid step
    vec2 extent;                      // m
    uint first_quad;                  // of this draw or dispatch
    uint has_heights;                 // 0: a level plain
};

// A coverage tile to produce.
struct CoverageTile {
    ivec2 cell;                       // height map texel of its south-west corner, gutter included
    vec2 cell_offset;                 // and the position in that texel
    float texel;                      // metres a texel
    uint layer;                       // first layer
    uint first;                       // word of the scratch buffer where its sums begin
    uint fine;                        // sums along a texel's side; 0: no discs
    uint step;                        // texels from one evaluated density to the next
    uint samples;                     // densities evaluated along a texel's side, where step is 1
};

// Discs to draw: a seed quad and a tile that they reach into.
struct CoverageSplat {
    vec2 corner;                      // of the seed quad from the tile's south-west corner, gutter included, m
    uint tile;                        // index of the coverage tile
};

// What producing coverage tiles takes, besides what producing seeds takes.
struct CoverageParameters {
    float largest_radius;             // of a disc, m
    uint first_tile;                  // of this dispatch
    uint first_splat;                 // of this dispatch
};

// What summing frames up takes.
struct AccumulationParameters {
    uint pixels;                      // of the image
    uint width;                       // of its rows
    uint first;                       // sum of its first pixel
    uint frame;                       // how many frames the sums hold already
    float part;                       // 1 over the number of frames after the last, else 0
};

// What tone mapping takes.
struct TonemapParameters {
    uvec2 size;                       // pixels
    float exposure;                   // factor before the curve
    uint parts;                       // images whose sum is the radiance: 1 or 2; 0: one of colours to show as they are
};
