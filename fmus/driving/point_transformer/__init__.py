"""The point transformer: an encoder of point clouds with PyTorch (extra `torch`).

A library, not a component: it makes keypoints with features of a lidar scan, in the shape that
COOPERNAUT published. docs/physics-policy.md describes it.
"""

from fmus.driving.point_transformer.checkpoint import load as load, save as save
from fmus.driving.point_transformer.cloud import Crop as Crop, resample as resample, thin as thin
from fmus.driving.point_transformer.encoder import (
    Keypoints as Keypoints,
    PointTransformerEncoder as PointTransformerEncoder,
)
from fmus.driving.point_transformer.message import encode as encode, to_message as to_message
from fmus.driving.point_transformer.sampling import (
    FarthestPoints as FarthestPoints,
    FirstPoints as FirstPoints,
    Sampling as Sampling,
)
