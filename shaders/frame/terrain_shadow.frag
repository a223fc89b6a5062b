// The ground is an opaque caster: its depth is all.
#version 450

void main() {}
