// Colours of trees that are drawn one by one in the view modes. Needs frame/view_mode.glsl.

// `draw` is which of the camera's draws the tree is in: magnified, with estimates, without, converged; or it is a mesh, a cloud of cards or the far form of one, or slices of a forest show it.
const uint MESH_DRAW = CAMERA_DRAWS;
const uint CARD_DRAW = CAMERA_DRAWS + 1u;
const uint FAR_FORM_DRAW = CAMERA_DRAWS + 2u;
const uint SHELL_DRAW = CAMERA_DRAWS + 3u;

vec3 tree_mode(uint draw, uint cascade, float lit) {
    // Normals of the ellipsoid that stands for the crown are no better than none: trees are grey.
    vec3 shown = vec3(0.5);
    if (VIEW_MODE == MODE_FRACTIONS) shown = fractions_colour(vec4(0.0, 0.0, lit, 1.0 - lit));
    if (VIEW_MODE == MODE_LOD) {
        // Not one expression: Mesa 22.3 selects only the first component of vectors by a specialization constant.
        shown = vec3(0.95, 0.85, 0.1);
        if (draw == 1u) shown = vec3(0.95, 0.45, 0.05);
        if (draw == 0u) shown = vec3(0.9, 0.1, 0.1);
        if (draw == 3u) shown = vec3(0.1, 0.7, 0.2);
        if (draw == MESH_DRAW) shown = vec3(0.8, 0.2, 0.8);
        if (draw == CARD_DRAW) shown = vec3(0.2, 0.35, 0.95);
        if (draw == FAR_FORM_DRAW) shown = vec3(0.15, 0.75, 0.85);
        if (draw == SHELL_DRAW) shown = vec3(0.55, 0.9, 0.35);
    }
    if (VIEW_MODE == MODE_CASCADES) shown = cascade_colour(cascade, cascade < MAX_CASCADES ? lit : 1.0);
    return shown;
}
