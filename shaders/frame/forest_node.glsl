// Between two nodes of the shader-map.
ForestNode mix_nodes(ForestNode a, ForestNode b, float t) {
    return ForestNode(mix(a.tree_sun, b.tree_sun, t), mix(a.tree_lit, b.tree_lit, t), mix(a.tree_sky, b.tree_sky, t),
                      mix(a.converged, b.converged, t), mix(a.over, b.over, t), mix(a.seen, b.seen, t),
                      mix(a.joint, b.joint, t), mix(a.seen_coverage, b.seen_coverage, t), mix(a.sky, b.sky, t),
                      mix(a.gap, b.gap, t), mix(a.middle, b.middle, t), mix(a.half_depth, b.half_depth, t));
}
