"""Vision models (paper, appendix C): SegFormer for classes and depth, Deformable DETR for objects."""
