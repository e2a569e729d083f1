"""The lidar of `fmus.lidar`, computed with PyTorch: on a GPU where there is one."""

from fmus.lidar_torch.component import LidarTorch as LidarTorch
