// palpate from C#, as in Unity: scene, state, steps, forces and surfaces. Put it beside libpalpate_c (palpate_c.dll on Windows).

using System;
using System.Collections.Generic;
using System.Runtime.InteropServices;

namespace Palpate
{
    /// <summary>Vector in SI units.</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct Vector
    {
        public double X, Y, Z;

        public Vector(double x, double y, double z)
        {
            X = x;
            Y = y;
            Z = z;
        }
    }

    /// <summary>Device after a step: force on the hand [N], and proxy [m].</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct DeviceOutput
    {
        public Vector ForceOnHand, Proxy;
    }

    /// <summary>Plane or obstacle after a step: net force on it [N], and torque about its position [N·m].</summary>
    [StructLayout(LayoutKind.Sequential)]
    public struct ObstacleOutput
    {
        public Vector Force, Torque;
    }

    /// <summary>Failure of the library, with its status (PalpateStatus in palpate.h).</summary>
    public class PalpateException : Exception
    {
        public readonly int Status;

        public PalpateException(int status, string message) : base(message)
        {
            Status = status;
        }
    }

    static class Library
    {
        const string Name = "palpate_c";

        public const uint AbiVersion = 1;

        [StructLayout(LayoutKind.Sequential)]
        public struct Error
        {
            public int Status;
            public uint Line;
            [MarshalAs(UnmanagedType.ByValArray, SizeConst = 1024)]
            public byte[] Message;
        }

        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern uint palpate_abi_version();
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern int palpate_scene_load(byte[] path, uint purpose, out IntPtr scene, out Error error);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern void palpate_scene_free(IntPtr scene);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern double palpate_scene_step_s(IntPtr scene);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_scene_find(IntPtr scene, uint part, byte[] name);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_scene_warning(IntPtr scene, UIntPtr number);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern UIntPtr palpate_scene_node_count(IntPtr scene, UIntPtr body);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_scene_triangles(IntPtr scene, UIntPtr body, out UIntPtr count);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern int palpate_state_new(IntPtr scene, out IntPtr state, out Error error);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern void palpate_state_free(IntPtr state);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern int palpate_state_set_position(IntPtr state, UIntPtr device, Vector position);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern int palpate_state_step(IntPtr state);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_state_warning(IntPtr state, UIntPtr number);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_state_devices(IntPtr state, out UIntPtr count);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_state_obstacles(IntPtr state, out UIntPtr count);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern IntPtr palpate_state_contacts(IntPtr state, out UIntPtr count);
        [DllImport(Name, CallingConvention = CallingConvention.Cdecl)] public static extern int palpate_state_surface(IntPtr state, UIntPtr body, double[] positions, UIntPtr count);

        public static byte[] Text(string text)
        {
            return System.Text.Encoding.UTF8.GetBytes(text + "\0");
        }

        /// <summary>Text of the library; null where there is none.</summary>
        public static string Text(IntPtr text)
        {
            if (text == IntPtr.Zero) return null;
            int length = 0;
            while (Marshal.ReadByte(text, length) != 0) length++;
            byte[] bytes = new byte[length];
            Marshal.Copy(text, bytes, 0, length);
            return System.Text.Encoding.UTF8.GetString(bytes);
        }

        public static void Check(int status, Error error)
        {
            if (status == 0) return;
            int end = Array.IndexOf(error.Message, (byte)0);
            throw new PalpateException(status, System.Text.Encoding.UTF8.GetString(error.Message, 0, end));
        }

        public static void Check(int status)
        {
            if (status != 0) throw new PalpateException(status, "status " + status + " (palpate.h)");
        }
    }

    /// <summary>Scene and its state. Its methods may be called by several threads: each waits for the other's call to end.</summary>
    public sealed class Simulation : IDisposable
    {
        const uint RealTime = 0, Device = 1;

        readonly object turn = new object();
        IntPtr scene, state;

        public Simulation(string sceneFile)
        {
            if (Library.palpate_abi_version() != Library.AbiVersion) throw new PalpateException(0, "the library is of another version");
            Library.Error error;
            Library.Check(Library.palpate_scene_load(Library.Text(sceneFile), RealTime, out scene, out error), error);
            int status = Library.palpate_state_new(scene, out state, out error);
            if (status != 0) Dispose();
            Library.Check(status, error);
        }

        /// <summary>Duration of a step [s].</summary>
        public double StepSeconds
        {
            get { return Library.palpate_scene_step_s(scene); }
        }

        /// <summary>Number of a device by its name; -1 where there is none.</summary>
        public int FindDevice(string name)
        {
            return (int)Library.palpate_scene_find(scene, Device, Library.Text(name));
        }

        /// <summary>Sets the position of a device at the end of the next step [m].</summary>
        public void SetPosition(int device, Vector position)
        {
            lock (turn) Library.Check(Library.palpate_state_set_position(state, (UIntPtr)(uint)device, position));
        }

        /// <summary>Advances by one step.</summary>
        public void Step()
        {
            lock (turn) Library.Check(Library.palpate_state_step(state));
        }

        /// <summary>Warnings about the scene and about the steps so far. For looking, not for each step.</summary>
        public List<string> Warnings()
        {
            lock (turn)
            {
                List<string> all = new List<string>();
                string text;
                for (uint at = 0; (text = Library.Text(Library.palpate_scene_warning(scene, (UIntPtr)at))) != null; at++) all.Add(text);
                for (uint at = 0; (text = Library.Text(Library.palpate_state_warning(state, (UIntPtr)at))) != null; at++) all.Add(text);
                return all;
            }
        }

        /// <summary>Device after the last step.</summary>
        public DeviceOutput Output(int device)
        {
            lock (turn)
            {
                UIntPtr count;
                IntPtr first = Library.palpate_state_devices(state, out count);
                if (device < 0 || device >= (int)count) throw new ArgumentOutOfRangeException("device");
                IntPtr own = IntPtr.Add(first, device * Marshal.SizeOf(typeof(DeviceOutput)));
                return (DeviceOutput)Marshal.PtrToStructure(own, typeof(DeviceOutput));
            }
        }

        /// <summary>Plane or obstacle after the last step, by its number in the scene file.</summary>
        public ObstacleOutput Obstacle(int number)
        {
            lock (turn)
            {
                UIntPtr count;
                IntPtr first = Library.palpate_state_obstacles(state, out count);
                if (number < 0 || number >= (int)count) throw new ArgumentOutOfRangeException("number");
                IntPtr own = IntPtr.Add(first, number * Marshal.SizeOf(typeof(ObstacleOutput)));
                return (ObstacleOutput)Marshal.PtrToStructure(own, typeof(ObstacleOutput));
            }
        }

        /// <summary>Number of contacts that carry force.</summary>
        public int Contacts
        {
            get
            {
                lock (turn)
                {
                    UIntPtr count;
                    Library.palpate_state_contacts(state, out count);
                    return (int)count;
                }
            }
        }

        /// <summary>Triangles of an object's surface, three node numbers each, outward by the right-hand rule.</summary>
        public int[] Triangles(int body)
        {
            UIntPtr count;
            IntPtr first = Library.palpate_scene_triangles(scene, (UIntPtr)(uint)body, out count);
            int[] triangles = new int[3 * (int)count];
            if (triangles.Length > 0) Marshal.Copy(first, triangles, 0, triangles.Length);
            return triangles;
        }

        /// <summary>Positions of an object's surface nodes [m], x, y, z in turn.</summary>
        public double[] Surface(int body)
        {
            double[] positions = new double[3 * (int)Library.palpate_scene_node_count(scene, (UIntPtr)(uint)body)];
            lock (turn) Library.Check(Library.palpate_state_surface(state, (UIntPtr)(uint)body, positions, (UIntPtr)(uint)positions.Length));
            return positions;
        }

        public void Dispose()
        {
            lock (turn)
            {
                Library.palpate_state_free(state);
                Library.palpate_scene_free(scene);
                state = scene = IntPtr.Zero;
            }
        }
    }
}
