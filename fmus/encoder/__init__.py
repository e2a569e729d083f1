"""The encoder of those who share: features of their scans."""

from fmus.encoder.component import FeatureEncoder as FeatureEncoder
