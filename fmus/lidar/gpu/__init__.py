"""The lidar of `fmus.lidar`, computed with PyTorch: on a GPU where there is one."""

from fmus.lidar.gpu.component import LidarTorch as LidarTorch
