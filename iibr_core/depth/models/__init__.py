"""Depth models: known ones and a user's files, downloaded, run by ONNX Runtime or torch, their estimates kept."""
